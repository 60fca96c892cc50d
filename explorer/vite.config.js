import { readFileSync } from "node:fs";
import { defineConfig } from "vite";

// The notices of everything in the bundle, in one file beside it.
const licenses = {
  name: "licenses",
  generateBundle() {
    const three = readFileSync(new URL("./node_modules/three/LICENSE", import.meta.url), "utf8");
    const version = JSON.parse(readFileSync(new URL("./node_modules/three/package.json", import.meta.url), "utf8")).version;
    const source = `explorer.js holds three.js ${version} (https://threejs.org), with OrbitControls and TeapotGeometry of its add-ons:\n\n${three}`;
    this.emitFile({ type: "asset", fileName: "LICENSES.txt", source });
  },
};

export default defineConfig({
  base: "./",
  plugins: [licenses],
  build: {
    outDir: "../src/gonio/explorer/static",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    chunkSizeWarningLimit: 900,
    rolldownOptions: {
      output: {
        entryFileNames: "explorer.js",
        chunkFileNames: "explorer-[name].js",
        assetFileNames: "explorer[extname]",
      },
    },
  },
});
