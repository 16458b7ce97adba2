// Parts of the page: base64 and deflate back into bytes, and states that are kept as what changed.

const partOf = (name) => document.getElementById(`part-${name}`);

function bytesOf(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at++) bytes[at] = letters.charCodeAt(at);
  return bytes;
}

async function inflated(name) {
  const stream = new Blob([bytesOf(partOf(name).textContent)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const documentOf = async (name) => JSON.parse(new TextDecoder().decode(await inflated(name)));

// Arrays over time. Each state is kept as what changed since the one before, so that going forwards is quick; going
// backwards begins anew, which takes milliseconds.
class Sequence {
  // `lengths` are those of the arrays of one state, `count` is the number of states.
  constructor(bytes, lengths, count) {
    this.bytes = bytes;
    this.arrays = lengths.map((length) => new Uint8Array(length));
    this.count = count;
    this.begin();
  }

  begin() {
    this.read = 0;
    this.now = -1;
    this.arrays.forEach((array) => array.fill(0));
  }

  // The arrays of a state; they are the same objects for every state.
  at(index) {
    if (index < this.now) this.begin();
    for (; this.now < Math.min(index, this.count - 1); this.now++) {
      for (const array of this.arrays) this.apply(array);
    }
    return this.arrays;
  }

  number() {
    let value = 0;
    let unit = 1;
    for (;;) {
      const byte = this.bytes[this.read++];
      value += (byte & 127) * unit;
      if (!(byte & 128)) return value;
      unit *= 128;
    }
  }

  apply(array) {
    let place = 0;
    for (let runs = this.number(); runs > 0; runs--) {
      place += this.number();
      const length = this.number();
      array.set(this.bytes.subarray(this.read, this.read + length), place);
      this.read += length;
      place += length;
    }
  }
}

// The last position in a rising list whose number is at most `step`.
function lastUpTo(list, step) {
  let found = 0;
  list.forEach((number, at) => {
    if (number <= step) found = at;
  });
  return found;
}

// An episode: its story, its beliefs and truths, and its images once they are asked for.
class Episode {
  static async read(letter) {
    const episode = new Episode();
    episode.letter = letter;
    episode.story = await documentOf(`${letter}-story`);
    const { dims, kept, truths } = episode.story;
    const cells = dims[0] * dims[1];
    const lengths = [cells * dims[2], cells, cells, cells];
    episode.states = new Sequence(await inflated(`${letter}-states`), lengths, kept.length);
    episode.truths = partOf(`${letter}-truths`) && new Sequence(await inflated(`${letter}-truths`), lengths, truths.length);
    episode.images = new Map();
    return episode;
  }

  get last() {
    return this.story.moments.length - 1;
  }

  // The step whose belief is shown at `step`: the same, unless the page holds fewer.
  keptAt(step) {
    return this.story.kept[lastUpTo(this.story.kept, step)];
  }

  beliefAt(step) {
    const [occupancy, classes, certainty, entropy] = this.states.at(lastUpTo(this.story.kept, step));
    return { occupancy, classes, certainty, entropy };
  }

  truthAt(step) {
    if (!this.truths) return null;
    const [occupancy, classes, low, high] = this.truths.at(lastUpTo(this.story.truths, this.keptAt(step)));
    const tells = low.some((byte) => byte) || high.some((byte) => byte);
    const background = Math.max(...classes);
    // Truths of old programs do not tell objects apart: there what is of one class is one thing.
    const object = tells ? (cell) => low[cell] | (high[cell] << 8) : (cell) => (classes[cell] === background ? 0 : classes[cell]);
    return { occupancy, classes, object };
  }

  // What the camera saw in the last look up to a step.
  cameraAt(step) {
    return this.story.cameras.filter((camera) => camera.step <= step).at(-1) ?? null;
  }

  async imageOf(camera) {
    if (!this.images.has(camera.step)) {
      const bytes = await inflated(`${this.letter}-camera-${camera.step}`);
      const pixels = camera.width * camera.height;
      const depth = bytes.slice(0, pixels);
      for (let at = 0; at < pixels; at++) if (at % camera.width) depth[at] = (depth[at] + depth[at - 1]) & 255;
      this.images.set(camera.step, { depth, labels: bytes.subarray(pixels) });
    }
    return this.images.get(camera.step);
  }
}
