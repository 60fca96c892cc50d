import { download } from "../dom.js";
import { copyText, textDialog } from "./dialog.js";
import { menu } from "./menu.js";

const LANGUAGES = { glsl: "GLSL", wgsl: "WGSL", hlsl: "HLSL", c: "C", cuda: "CUDA", osl: "OSL" };

const fileName = (material, ending) => `${material.title.replace(/[^\w.-]+/g, "-").replace(/^-|-$/g, "").slice(0, 40) || "material"}${ending}`;

/** The menu of everything that leaves the page about one material. */
export function exportMenu(app, material) {
  const guarded = (act) => async () => {
    try {
      await act();
    } catch (error) {
      app.errors.show(error);
    }
  };
  const source = (language) => guarded(async () => {
    const functions = ["f", "pdf", "sample"];
    const { text } = language === "glsl" && app.offline
      ? { text: material.glsl.text }
      : await app.ask("source", material, { language, function: functions, parameters: "constants" }, "source");
    textDialog(`${LANGUAGES[language]} source of ${material.title}`, text, fileName(material, `.${{ cuda: "cu" }[language] ?? language}`));
  });
  const described = () => (app.offline ? material : app.ask("material", material, {}, `export ${material.index}`));
  return menu(
    "Export",
    () => [
      "Picture",
      ...app.shownViews().filter((view) => view.picture).map((view) => [`PNG of ${view.constructor.title}`, () => view.save("png")]),
      "Numbers",
      ["CSV of f in the plane of incidence", guarded(async () => {
        const { theta, phi } = app.state;
        const { csv } = await app.ask("data", material, { theta_i: theta, phi_i: phi }, "data");
        download(fileName(material, ".csv"), csv, "text/csv");
      })],
      "Source code",
      ...Object.keys(LANGUAGES).filter((one) => !app.offline || one === "glsl").map((one) => [LANGUAGES[one], source(one)]),
      "Elsewhere",
      ["Python", guarded(async () => textDialog("The same material in Python", (await described()).snippet, "material.py"))],
      ["Command line", guarded(async () => textDialog("The same on the command line", (await described()).command))],
      ["Link to this view", guarded(async () => {
        if (!(await copyText(location.href))) textDialog("Link to this view", location.href);
        else app.say("The link is copied.");
      })],
    ],
    { "data-testid": `export-${material.index}`, "aria-label": `Export ${material.title}` },
  );
}
