// The page: one clock, one camera and one choice of colours for all episodes; its state stands behind the # of its address.

const COLOURS = [["class", "class"], ["probability", "probability"], ["entropy", "entropy"], ["error", "error"]];
const LAYOUTS = [["overview", "Overview"], ["space", "3D"], ["maps", "Maps"], ["decision", "Decision"]];
const KEYS = "← → step, Home End first and last, space plays, C colour, [ ] probability, L layout, T light or dark, R camera; in 3D shift and arrows turn, + − zoom";
const PANELS = { dark: [[66, 62, 56], [52, 49, 45], [58, 55, 50], [58, 55, 50]], light: [[222, 212, 196], [206, 197, 182], [214, 205, 189], [214, 205, 189]] };
const CORRECT = [226, 228, 232];

class Page {
  static async open() {
    const page = new Page();
    page.common = await documentOf("common");
    page.episodes = await Promise.all(["a", "b"].filter((letter) => partOf(`${letter}-story`)).map((letter) => Episode.read(letter)));
    page.last = Math.max(...page.episodes.map((episode) => episode.last));
    page.colours = COLOURS.filter(([key]) => key !== "error" || page.episodes.some((episode) => episode.truths));
    page.usual = { step: page.last, layout: "overview", colour: "class", above: 0.5, camera: DEFAULT_CAMERA, theme: "" };
    page.state = { ...page.usual };
    page.dark = matchMedia("(prefers-color-scheme: dark)");
    page.build();
    page.readAddress();
    page.listen();
    page.everything();
    document.documentElement.dataset.ready = "yes";
    return page;
  }

  build() {
    const { common, episodes } = this;
    this.palette = {
      classes: common.classes.map(([, colour]) => rgbOf(colour)), unknown: rgbOf(common.unknown), errors: common.errors.map(([, colour]) => rgbOf(colour)),
      viridis: scaleOf(common.viridis), magma: scaleOf(common.magma),
    };
    const goTo = (step) => this.goTo(step);
    const letters = episodes.length > 1 ? ["A: ", "B: "] : [""];
    this.panes = episodes.map((episode, at) => new Pane(this, episode, letters[at]));
    this.maps = episodes.map((episode, at) => new Maps(common, this.palette, episode, letters[at] && `${letters[at]}${episode.story.title}`));
    this.charts = chartsOf(common, episodes, goTo);
    this.stories = episodes.map((episode, at) => new StoryPanel(common, episode, letters[at], goTo));
    const named = (parts, id) => make("section", { id, "aria-label": id }, ...parts.map(({ root }) => root));
    const main = document.getElementById("main");
    main.dataset.episodes = episodes.length;
    main.append(
      make("section", { id: "spaces", "aria-label": "Belief in 3D" }, ...this.panes.map(({ root }) => root)),
      this.tools(),
      make("section", { id: "curves", "aria-label": "Scores" }, ...this.charts.map(({ root }) => root)),
      make("div", { id: "side" }, named(this.maps, "maps"), named(this.stories, "story")));
    if (common.differences.length) {
      document.getElementById("introduction").after(make("p", { class: "warning" }, common.differences.join(" ")));
    }
    this.buttons();
    this.clock = new Clock(this);
  }

  tools() {
    const choose = (name, options, set) => {
      const select = make("select", { name, onchange: (event) => set(event.target.value) }, ...options.map(([value, title]) => make("option", { value }, title)));
      return [make("label", {}, `${name} `, select), select];
    };
    const [colour, colourSelect] = choose("colour by", this.colours, (value) => this.set({ colour: value }));
    const [layout, layoutSelect] = choose("layout", LAYOUTS, (value) => this.set({ layout: value }));
    const slider = make("input", { type: "range", id: "above", min: this.common.lowest, max: 0.99, step: 0.01, oninput: (event) => this.set({ above: +event.target.value }) });
    this.above = make("output", { for: "above" });
    this.legend = make("span", { class: "legend" });
    this.inputs = { colour: colourSelect, layout: layoutSelect, slider };
    const reset = make("button", { onclick: () => this.set({ camera: DEFAULT_CAMERA }) }, "Reset camera");
    return make("section", { id: "tools", "aria-label": "Display" }, colour,
      make("label", {}, "probability above ", slider, this.above), layout, reset, this.legend);
  }

  buttons() {
    const nav = document.getElementById("buttons");
    nav.append(make("button", { id: "theme", title: "Light or dark", onclick: () => this.toggleTheme() }, "Light or dark"));
    this.episodes.forEach((episode, at) => {
      const { recording_bytes: bytes, title } = episode.story;
      const which = this.episodes.length > 1 ? ` ${"AB"[at]}` : "";
      if (bytes) nav.append(make("button", { class: "recording", title: "The recording for the Rerun viewer", onclick: () => this.download(episode, title) }, `Recording${which} (.rrd, ${(bytes / 1e6).toFixed(1)} MB)`));
    });
  }

  download(episode, title) {
    const url = URL.createObjectURL(new Blob([bytesOf(partOf(`${episode.letter}-recording`).textContent)]));
    make("a", { href: url, download: `${title.replace(/[^\w.-]+/g, "-")}.rrd` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }

  listen() {
    addEventListener("hashchange", () => {
      if (location.hash.slice(1) === this.address()) return;
      this.readAddress();
      this.everything();
    });
    addEventListener("resize", () => this.everything());
    this.dark.addEventListener("change", () => this.everything());
    addEventListener("beforeprint", () => this.print(true));
    addEventListener("afterprint", () => this.print(false));
    addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input[type=text]")) return;
    const isInSpace = event.target.matches("canvas.space");
    const turn = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (turn && event.shiftKey) {
      this.turn(...turn);
      return event.preventDefault();
    }
    if (event.target.matches("input[type=range]") && /^(Arrow|Home|End)/.test(event.key)) return undefined;
    const next = (options, now) => options[(options.findIndex(([key]) => key === now) + 1) % options.length][0];
    const { state } = this;
    const done = {
      ArrowLeft: () => this.goTo(state.step - 1), ArrowRight: () => this.goTo(state.step + 1),
      Home: () => this.goTo(0), End: () => this.goTo(this.last),
      " ": () => (event.target.matches("button, summary") ? false : this.clock.play()),
      c: () => this.set({ colour: next(this.colours, state.colour) }), l: () => this.set({ layout: next(LAYOUTS, state.layout) }),
      "[": () => this.set({ above: state.above - 0.05 }), "]": () => this.set({ above: state.above + 0.05 }),
      t: () => this.toggleTheme(), r: () => this.set({ camera: DEFAULT_CAMERA }),
      "+": () => isInSpace && this.zoom(0.9), "-": () => isInSpace && this.zoom(1.1),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (done && done() !== false) event.preventDefault();
    return undefined;
  }

  goTo(step) {
    this.set({ step });
  }

  turn(turn, tilt) {
    const { camera } = this.state;
    this.set({ camera: { ...camera, turn: camera.turn + turn, tilt: camera.tilt + tilt } });
  }

  zoom(factor) {
    this.set({ camera: { ...this.state.camera, distance: this.state.camera.distance * factor } });
  }

  toggleTheme() {
    this.set({ theme: this.theme.isLight ? "dark" : "light" });
  }

  // Takes what is new of the state, within its bounds, and draws what depends on it.
  set(change) {
    const before = this.state;
    this.state = this.bounded({ ...before, ...change });
    const differs = (...keys) => keys.some((key) => JSON.stringify(before[key]) !== JSON.stringify(this.state[key]));
    if (differs("theme", "layout")) this.everything();
    else {
      if (differs("step")) this.moment();
      if (differs("step", "colour", "above")) this.voxels();
      if (differs("camera")) this.spaces();
    }
    this.writeAddress();
  }

  bounded(state) {
    const within = (value, low, high, usual) => (Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : usual);
    const one = (options, value, usual) => (options.some(([key]) => key === value) ? value : usual);
    const { usual } = this;
    const camera = state.camera ?? usual.camera;
    return {
      step: Math.round(within(state.step, 0, this.last, usual.step)),
      layout: one(LAYOUTS, state.layout, usual.layout),
      colour: one(this.colours, state.colour, usual.colour),
      above: +within(state.above, this.common.lowest, 0.99, usual.above).toFixed(2),
      camera: {
        turn: within(camera.turn, -1e3, 1e3, 0), tilt: within(camera.tilt, -0.2, 1.55, DEFAULT_CAMERA.tilt),
        distance: within(camera.distance, 0.15, 3, 1), pan: DEFAULT_CAMERA.pan.map((_, at) => within(camera.pan?.[at], -1, 1, 0)),
      },
      theme: ["light", "dark"].includes(state.theme) ? state.theme : "",
    };
  }

  // `step=4&layout=overview&colour=class&above=0.50&camera=0.000,0.420,1.000,0.000,0.000,0.000`
  address() {
    const { step, layout, colour, above, camera, theme } = this.state;
    const numbers = [camera.turn, camera.tilt, camera.distance, ...camera.pan].map((value) => value.toFixed(3));
    return `step=${step}&layout=${layout}&colour=${colour}&above=${above.toFixed(2)}&camera=${numbers.join(",")}${theme ? `&theme=${theme}` : ""}`;
  }

  readAddress() {
    const said = new URLSearchParams(location.hash.slice(1));
    const number = (name) => (said.get(name) === null || said.get(name) === "" ? NaN : Number(said.get(name)));
    const [turn, tilt, distance, ...pan] = (said.get("camera") ?? "").split(",").map((text) => (text === "" ? NaN : Number(text)));
    this.state = this.bounded({
      step: number("step"), layout: said.get("layout"), colour: said.get("colour"), above: number("above"),
      camera: { turn, tilt, distance, pan }, theme: said.get("theme") ?? this.state.theme,
    });
  }

  writeAddress() {
    clearTimeout(this.writing);
    this.writing = setTimeout(() => history.replaceState(null, "", `#${this.address()}`), 150);
  }

  everything() {
    const isLight = this.isPrinting || (this.state.theme ? this.state.theme === "light" : !this.dark.matches);
    this.theme = { isLight, walls: isLight ? PANELS.light : PANELS.dark };
    document.documentElement.dataset.theme = isLight ? "light" : "dark";
    document.getElementById("main").dataset.layout = this.isPrinting ? "overview" : this.state.layout;
    this.moment();
    this.voxels();
  }

  moment() {
    const { step } = this.state;
    this.clock.draw();
    this.charts.forEach((chart) => chart.draw(step, this.theme));
    this.stories.forEach((story) => story.draw(step));
    this.drawn = Promise.all(this.maps.map((maps) => maps.draw(step)));
    this.panes.forEach((pane) => pane.lines());
  }

  voxels() {
    const { colour, above } = this.state;
    this.inputs.colour.value = colour;
    this.inputs.layout.value = this.state.layout;
    this.inputs.slider.value = above;
    this.above.textContent = above.toFixed(2);
    this.legend.replaceChildren(...this.legendOf(colour));
    this.panes.forEach((pane) => pane.voxels());
    this.spaces();
  }

  legendOf(colour) {
    const { common } = this;
    if (colour === "probability") return [scaleBar(common.viridis, "0", "probability", "1")];
    if (colour === "entropy") return [scaleBar(common.magma, "0", "nats a voxel", "0.69")];
    if (colour === "class") {
      if (this.state.layout !== "space") return [make("span", { class: "weak" }, "colours: see Classes")];
      return common.classes.slice(0, -1).map(([name, css]) => swatch(css, name));
    }
    const [, , missed, hallucinated] = common.errors;
    return [swatch(cssOf(CORRECT), "correct"), swatch(hallucinated[1], "believed, not there"), swatch(missed[1], "there, not believed")];
  }

  spaces() {
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => {
      this.isAsked = false;
      this.panes.forEach((pane) => pane.draw());
    });
  }

  // Paper is light, and has the whole page with its state in words.
  print(isPrinting) {
    this.isPrinting = isPrinting;
    const { step, colour, above } = this.state;
    document.getElementById("printed").textContent = `State: step ${step} of ${this.last}, voxels above ${above.toFixed(2)} coloured by ${colour}; #${this.address()}`;
    this.everything();
    if (isPrinting) this.panes.forEach((pane) => pane.keepStill());
  }
}

Page.open().catch((error) => {
  const trouble = document.getElementById("trouble");
  trouble.hidden = false;
  trouble.textContent = typeof DecompressionStream === "undefined"
    ? "This page needs a browser of 2023 or later: this one cannot unpack what is in it."
    : `This page could not be shown: ${error.message}`;
});
