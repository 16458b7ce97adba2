// The belief of one episode in 3D, with what a hand can do to it; all panes share a camera.

const LINE_COLOURS = { dark: { edge: [150, 150, 156], board: [104, 100, 92], truth: [255, 255, 255] }, light: { edge: [110, 110, 116], board: [188, 178, 162], truth: [40, 42, 48] } };
const STILL = [1400, 760]; // pixels of a picture for paper
const ACTED = [255, 112, 67];
const STEPS_OF_ENTROPY = Float32Array.from({ length: 256 }, (_, byte) => {
  const p = Math.min(Math.max(byte / 255, 1e-6), 1 - 1e-6);
  return -(p * Math.log(p) + (1 - p) * Math.log(1 - p)) / Math.LN2;
});
const packedColour = ([red, green, blue]) => ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;

class Pane {
  constructor(page, episode, letter) {
    Object.assign(this, { page, episode });
    this.canvas = make("canvas", { class: "space", tabindex: 0, role: "img", "aria-label": `${letter}the belief in three dimensions; drag to turn, wheel or pinch to zoom` });
    this.words = make("p", { class: "over weak" });
    const heading = letter ? make("h2", { class: "over" }, `${letter}${episode.story.title}`) : null;
    this.still = make("canvas", { class: "still", width: STILL[0], height: STILL[1] });
    this.root = make("div", { class: "pane" }, heading, this.canvas, this.still, this.words);
    try {
      this.space = new Space(this.canvas);
      this.space.setShelf(episode.story);
      this.hold();
    } catch (error) {
      this.canvas.hidden = true;
      this.words.textContent = `This browser draws nothing in 3D (${error.message}); maps and numbers are all there.`;
    }
  }

  // The voxels that are shown, by class, probability, entropy or error.
  voxels() {
    if (!this.space) return;
    const { page, episode } = this;
    const { colour, above, step } = page.state;
    const { dims, voxel_m } = episode.story;
    const { occupancy, classes } = episode.beliefAt(step);
    const truth = colour === "error" ? episode.truthAt(step) : null;
    const least = Math.floor(above * 255 + 1e-6);
    const shown = new Uint8Array(occupancy.length);
    for (let at = 0; at < shown.length; at++) shown[at] = occupancy[at] > least || (truth && truth.occupancy[at]) ? 1 : 0;
    const outside = countOutside(dims, shown);
    const colourOf = this.colouring(colour, { occupancy, classes, truth, least });
    let [edge, size, blocks, paint, count] = [1, dims, shown, colourOf, outside];
    while (count > page.common.most_voxels) {
      edge++;
      const grouped = blocksOf(dims, shown, occupancy, edge);
      [size, blocks] = [grouped.dims, grouped.shown];
      paint = (block) => colourOf(grouped.chosen[block]);
      count = countOutside(size, blocks);
    }
    this.space.setFaces(facesOf(size, blocks, paint), edge * voxel_m);
    this.words.textContent = this.describe(step, outside, edge, above);
  }

  describe(step, outside, edge, above) {
    const { episode } = this;
    const parts = [outside ? `${outside.toLocaleString("en-US")} voxels` : `No voxel is more probable than ${above.toFixed(2)}`];
    if (edge > 1) parts.push(`thinned: drawn as blocks of ${figure(1e3 * edge * episode.story.voxel_m)} mm`);
    const kept = episode.keptAt(step);
    if (kept !== Math.min(step, episode.last)) parts.push(`belief of step ${kept}`);
    return parts.join(" · ");
  }

  colouring(colour, { occupancy, classes, truth, least }) {
    const { palette, common } = this.page;
    const height = this.episode.story.dims[2];
    const table = (scale) => Uint32Array.from(scale, packedColour);
    if (colour === "probability") {
      const colours = table(palette.viridis);
      return (at) => colours[occupancy[at]];
    }
    if (colour === "entropy") {
      const colours = table(Array.from(STEPS_OF_ENTROPY, (share) => palette.magma[Math.round(255 * share)]));
      return (at) => colours[occupancy[at]];
    }
    if (truth) {
      const [correct, missed, hallucinated] = [CORRECT, palette.errors[2], palette.errors[3]].map(packedColour);
      return (at) => (occupancy[at] <= least ? missed : truth.occupancy[at] ? correct : hallucinated);
    }
    // Background and what is unknown are grey.
    const grey = packedColour(palette.unknown);
    const colours = [grey, ...table(palette.classes)];
    colours[common.classes.length] = grey;
    return (at) => colours[classes[Math.floor(at / height)]];
  }

  // The shelf's edges, a grid of 10 cm on the board, the outlines of what is true, and what the arm or the camera did.
  lines() {
    if (!this.space) return;
    const { page, episode, space } = this;
    const { low, high } = space;
    const colours = LINE_COLOURS[page.theme.isLight ? "light" : "dark"];
    const segments = [];
    const add = (from, to, colour, alpha = 255) => segments.push([from, to, [...colour, alpha]]);
    for (let x = Math.ceil(low[0] * 10 - 1e-4) / 10; x <= high[0] + 1e-4; x += 0.1) add([x, low[1], low[2]], [x, high[1], low[2]], colours.board);
    for (let y = low[1]; y <= high[1] + 1e-4; y += 0.1) add([low[0], y, low[2]], [high[0], y, low[2]], colours.board);
    for (let corner = 0; corner < 8; corner++) {
      const place = (bits) => low.map((value, axis) => ((bits >> axis) & 1 ? high[axis] : value));
      for (const bit of [1, 2, 4]) if (!(corner & bit)) add(place(corner), place(corner | bit), colours.edge);
    }
    this.outlines((from, to) => add(from, to, colours.truth, 190));
    const moment = episode.story.moments[Math.min(page.state.step, episode.last)];
    const camera = moment.kind === "look" ? episode.story.cameras.find(({ step }) => step === page.state.step) : null;
    for (const line of camera ? [camera.frustum] : moment.lines) line.slice(1).forEach((to, at) => add(line[at], to, ACTED));
    space.setLines(segments);
  }

  // The outline of every true object as high as the object is, with its corners down to the board.
  outlines(add) {
    const { episode, space } = this;
    const truth = episode.truthAt(this.page.state.step);
    if (!truth) return;
    const { dims, voxel_m } = episode.story;
    const [width, depth, height] = dims;
    const tops = new Map();
    for (let cell = 0; cell < width * depth; cell++) {
      const object = truth.object(cell);
      if (!object) continue;
      const top = truth.occupancy.subarray(cell * height, (cell + 1) * height).lastIndexOf(1) + 1;
      tops.set(object, Math.max(tops.get(object) ?? 0, top));
    }
    const objectAt = (x, row) => {
      if (x < 0 || row < 0 || x >= width || row >= depth) return 0;
      return truth.object(x * depth + depth - 1 - row);
    };
    const place = (x, row, z) => [space.low[0] + x * voxel_m, space.low[1] + (depth - row) * voxel_m, space.low[2] + z * voxel_m];
    for (const [x0, y0, x1, y1] of outlinesOf(dims, truth)) {
      const beside = x0 === x1 ? [objectAt(x0 - 1, y0), objectAt(x0, y0)] : [objectAt(x0, y0 - 1), objectAt(x0, y0)];
      for (const top of new Set(beside.filter(Boolean).map((object) => tops.get(object)))) add(place(x0, y0, top), place(x1, y1, top));
    }
  }

  draw() {
    if (!this.space || !this.canvas.clientWidth) return;
    this.space.draw(this.page.state.camera, this.page.theme);
  }

  // A picture for paper: what WebGL draws is not always printed as it was drawn last.
  keepStill() {
    if (!this.space) return;
    this.space.draw(this.page.state.camera, this.page.theme, STILL);
    const pen = this.still.getContext("2d");
    pen.clearRect(0, 0, ...STILL);
    pen.drawImage(this.canvas, 0, 0);
  }

  // Mouse and touch: one finger turns, two zoom and move; the wheel zooms, the right button or shift moves.
  hold() {
    const { canvas, page } = this;
    const fingers = new Map();
    const spread = ([a, b]) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    const middle = (points) => [0, 1].map((axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length);
    const move = (across, down) => {
      const { camera } = page.state;
      const { right, up } = this.space.axes(camera);
      const metre = (1.2 * camera.distance) / Math.max(1, canvas.clientHeight);
      page.set({ camera: { ...camera, pan: camera.pan.map((value, at) => value - metre * (across * right[at] - down * up[at])) } });
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const old = [...fingers.values()];
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      const now = [...fingers.values()];
      const [across, down] = minus(middle(now), middle(old));
      if (fingers.size > 1) {
        page.zoom(spread(old) / Math.max(1, spread(now)));
        move(across, down);
      } else if (event.shiftKey || event.buttons & 2) move(across, down);
      else page.turn(-0.008 * across, 0.006 * down);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      page.zoom(Math.exp(0.0012 * Math.max(-120, Math.min(120, event.deltaY))));
    }, { passive: false });
    canvas.addEventListener("redraw", () => {
      this.space.setShelf(this.episode.story);
      page.everything();
    });
  }
}
