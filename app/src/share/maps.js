// Floor maps seen from above, the front edge at the bottom, and what the camera saw.

const SHARP = 4; // pixels of a map for every floor cell

// The edges between floor cells of different objects, as segments in cells from the left and from the back.
function outlinesOf(dims, truth) {
  const [width, depth] = dims;
  const object = (x, row) => {
    if (x < 0 || row < 0 || x >= width || row >= depth) return 0;
    return truth.object(x * depth + depth - 1 - row);
  };
  const segments = [];
  const runs = (count, differs, add) => {
    for (let at = 0, from = -1; at <= count; at++) {
      const now = at < count && differs(at);
      if (now && from < 0) from = at;
      if (!now && from >= 0) {
        add(from, at);
        from = -1;
      }
    }
  };
  for (let x = 0; x <= width; x++) {
    runs(depth, (row) => object(x - 1, row) !== object(x, row), (a, b) => segments.push([x, a, x, b]));
  }
  for (let row = 0; row <= depth; row++) {
    runs(width, (x) => object(x, row - 1) !== object(x, row), (a, b) => segments.push([a, row, b, row]));
  }
  return segments;
}

// How a cell's class compares with the truth: a position in the list of errors.
function errorOf(believed, truth, background) {
  if (believed === truth) return 0;
  if (believed === 0 && truth === background) return 1;
  if (believed === 0 || believed === background) return 2;
  return truth === background ? 3 : 4;
}

// The kinds of maps: title, colour of a cell, words on a cell, and legend.
function mapKinds(common, palette, story) {
  const background = common.classes.length;
  const share = (byte) => (byte / 255).toFixed(2);
  const className = (number) => (number ? common.classes[number - 1][0] : "unknown");
  return [
    {
      key: "semantics",
      title: "Semantics",
      colour: ({ classes, certainty }, _, cell) =>
        classes[cell] ? mixed(palette.unknown, palette.classes[classes[cell] - 1], Math.min(1, 0.4 + (0.6 * certainty[cell]) / 255)) : palette.unknown,
      words: ({ classes, certainty }, _, cell) => `${className(classes[cell])}, probability ${share(certainty[cell])}`,
      legend: () => make("p", { class: "weak" }, "colours: see Classes; paler where less sure"),
    },
    {
      key: "certainty",
      title: "Certainty",
      colour: ({ certainty }, _, cell) => palette.viridis[certainty[cell]],
      words: ({ certainty }, _, cell) => `probability of the likeliest class ${share(certainty[cell])}`,
      legend: () => scaleBar(common.viridis, "0", "probability", "1"),
    },
    {
      key: "entropy",
      title: "Entropy",
      colour: ({ entropy }, _, cell) => palette.magma[entropy[cell]],
      words: ({ entropy }, _, cell) => `entropy ${figure((entropy[cell] / 255) * story.entropy_top)} nats`,
      legend: () => scaleBar(common.magma, "0", "nats", figure(story.entropy_top)),
    },
    {
      key: "truth",
      title: "Truth",
      needsTruth: true,
      colour: (_, truth, cell) => palette.classes[truth.classes[cell] - 1],
      words: (_, truth, cell) => `really ${className(truth.classes[cell])}`,
      legend: () => make("p", { class: "weak" }, "colours: see Classes"),
    },
    {
      key: "error",
      title: "Error",
      needsTruth: true,
      colour: ({ classes }, truth, cell) => palette.errors[errorOf(classes[cell], truth.classes[cell], background)],
      words: ({ classes }, truth, cell) =>
        `${common.errors[errorOf(classes[cell], truth.classes[cell], background)][0]}: believed ${className(classes[cell])}, really ${className(truth.classes[cell])}`,
      legend: () => make("p", { class: "legend" }, ...common.errors.map(([title, colour]) => swatch(colour, title))),
    },
  ];
}

class Maps {
  constructor(common, palette, episode, heading) {
    Object.assign(this, { common, palette, episode });
    this.kinds = mapKinds(common, palette, episode.story).filter((kind) => episode.truths || !kind.needsTruth);
    this.readout = make("p", { class: "readout weak" });
    const [width, depth] = episode.story.dims;
    this.shown = this.kinds.map((kind) => {
      const canvas = make("canvas", { width: SHARP * width, height: SHARP * depth, role: "img", "aria-label": `${kind.title}, floor map` });
      canvas.addEventListener("pointermove", (event) => this.point(kind, canvas, event));
      canvas.addEventListener("pointerdown", (event) => this.point(kind, canvas, event));
      canvas.addEventListener("pointerleave", () => (this.readout.textContent = this.usual));
      return { kind, canvas, figure: make("figure", { class: `map ${kind.key}` }, make("h3", {}, kind.title), canvas, kind.legend()) };
    });
    this.usual = "Seen from above, front edge at the bottom. Point at a map to read it.";
    this.readout.textContent = this.usual;
    this.classes = make("div", { class: "legend" });
    const legend = make("figure", { class: "map classes" }, make("h3", {}, "Classes"), this.classes);
    this.camera = new Camera(common, palette, episode);
    this.grid = make("div", { class: "maps" }, ...this.shown.map(({ figure }) => figure), legend);
    this.root = make("div", { class: "of-episode" }, heading && make("h2", {}, heading), this.readout, this.grid, this.camera.root);
  }

  point(kind, canvas, event) {
    const { story } = this.episode;
    const [width, depth] = story.dims;
    const column = Math.floor((event.offsetX / canvas.clientWidth) * width);
    const row = Math.floor((event.offsetY / canvas.clientHeight) * depth);
    if (column < 0 || row < 0 || column >= width || row >= depth) return;
    const y = depth - 1 - row;
    const at = [column, y].map((number, axis) => metres(story.origin[axis] + (number + 0.5) * story.voxel_m));
    const { belief, truth } = this.state;
    this.readout.textContent = `x ${at[0]}, y ${at[1]} m: ${kind.words(belief, truth, column * depth + y)}`;
  }

  draw(step) {
    const { episode, palette, common } = this;
    const [width, depth] = episode.story.dims;
    this.state = { belief: episode.beliefAt(step), truth: episode.truthAt(step) };
    const outlines = this.state.truth ? outlinesOf(episode.story.dims, this.state.truth) : [];
    const plain = new OffscreenCanvas(width, depth);
    const small = plain.getContext("2d");
    for (const { kind, canvas } of this.shown) {
      const image = small.createImageData(width, depth);
      for (let row = 0, at = 0; row < depth; row++) {
        for (let x = 0; x < width; x++, at += 4) {
          const colour = kind.colour(this.state.belief, this.state.truth, x * depth + depth - 1 - row);
          image.data.set(colour, at);
          image.data[at + 3] = 255;
        }
      }
      small.putImageData(image, 0, 0);
      const pen = canvas.getContext("2d");
      pen.imageSmoothingEnabled = false;
      pen.drawImage(plain, 0, 0, SHARP * width, SHARP * depth);
      pen.strokeStyle = kind.key === "entropy" ? "rgb(150 150 160)" : "rgb(20 20 24)";
      pen.lineWidth = SHARP / 2;
      pen.beginPath();
      for (const [x0, y0, x1, y1] of outlines) {
        pen.moveTo(SHARP * x0, SHARP * y0);
        pen.lineTo(SHARP * x1, SHARP * y1);
      }
      pen.stroke();
    }
    const there = new Set(this.state.belief.classes);
    if (this.state.truth) this.state.truth.classes.forEach((number) => there.add(number));
    const patches = [...there].filter((number) => number > 0).sort((a, b) => a - b)
      .map((number) => swatch(cssOf(palette.classes[number - 1]), common.classes[number - 1][0]));
    this.classes.replaceChildren(...patches, swatch(common.unknown, "unknown"));
    return this.camera.draw(step);
  }
}

// The depths and labels of the last look.
class Camera {
  constructor(common, palette, episode) {
    Object.assign(this, { common, palette, episode });
    this.title = make("h3", {}, "Camera");
    this.canvases = ["depth", "labels"].map((name) => make("canvas", { role: "img", "aria-label": `Camera: ${name}` }));
    this.depth = make("div", {});
    const figures = this.canvases.map((canvas, at) =>
      make("figure", { class: "map" }, canvas, at ? make("p", { class: "weak" }, "labels: colours as in Classes") : this.depth));
    this.none = make("p", { class: "weak" });
    this.pictures = make("div", { class: "pictures" }, ...figures);
    this.root = make("section", { class: "camera" }, this.title, this.none, this.pictures);
  }

  async draw(step) {
    const { episode, palette } = this;
    const camera = episode.cameraAt(step);
    this.pictures.hidden = !camera;
    this.none.hidden = !!camera;
    this.title.textContent = camera ? `Camera: the look in step ${camera.step}` : "Camera";
    if (!camera) {
      this.none.textContent = episode.story.cameras.length
        ? "Nothing was seen before the first look."
        : "No images are filed with this episode.";
      return;
    }
    const { depth, labels } = await episode.imageOf(camera);
    const paints = [(at) => (depth[at] ? Array(3).fill(20 + Math.round((235 * (depth[at] - 1)) / 254)) : [58, 30, 58]),
      (at) => (labels[at] ? palette.classes[labels[at] - 1] : palette.unknown)];
    this.canvases.forEach((canvas, which) => {
      [canvas.width, canvas.height] = [camera.width, camera.height];
      const pen = canvas.getContext("2d");
      const image = pen.createImageData(camera.width, camera.height);
      for (let at = 0; at < depth.length; at++) {
        image.data.set(paints[which](at), 4 * at);
        image.data[4 * at + 3] = 255;
      }
      pen.putImageData(image, 0, 0);
    });
    const [near, far] = camera.depth_m;
    this.depth.replaceChildren(scaleBar(["#141414", ...Array(6).fill(""), "#ffffff"], near.toFixed(2), "depth, m", far.toFixed(2)));
  }
}
