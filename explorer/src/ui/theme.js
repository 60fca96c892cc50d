/** Light and dark: as the system has it, or as chosen; colours of the page as numbers for the GPU. */
export class Theme {
  constructor(state, changed) {
    this.state = state;
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.system.addEventListener("change", () => this.apply(changed));
    this.changed = changed;
    this.apply(() => {});
  }

  get dark() {
    return this.state.theme === "auto" ? this.system.matches : this.state.theme === "dark";
  }

  choose(theme) {
    this.state.theme = theme;
    this.apply(this.changed);
  }

  apply(told) {
    document.documentElement.dataset.theme = this.dark ? "dark" : "light";
    this.cache = null;
    told();
  }

  colours() {
    this.cache ??= { ink: this.variable("--ink"), grid: this.variable("--grid"), accent: this.variable("--light"), dark: this.dark };
    return this.cache;
  }

  accent() {
    return getComputedStyle(document.documentElement).getPropertyValue("--light").trim();
  }

  variable(name) {
    return this.rgb(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  }

  /** "#rrggbb" as three numbers up to 1. */
  rgb(hex, gain = 1) {
    return [1, 3, 5].map((k) => Math.min(1, (gain * Number.parseInt(hex.slice(k, k + 2), 16)) / 255));
  }
}
