// The faces of voxels that can be seen, by the side of the cube that they are.

// Three words a face: x and y, z and length, colour.
class Faces {
  constructor() {
    this.words = new Uint32Array(3 * 1024);
    this.count = 0;
  }

  push(x, y, z, length, colour) {
    const at = 3 * this.count;
    if (at === this.words.length) {
      const more = new Uint32Array(2 * this.words.length);
      more.set(this.words);
      this.words = more;
    }
    this.words[at] = x | (y << 16);
    this.words[at + 1] = z | (length << 16);
    this.words[at + 2] = colour;
    this.count++;
  }

  get filled() {
    return this.words.subarray(0, 3 * this.count);
  }
}

// How many of the voxels have a side that can be seen. Nobody looks from below the board.
function countOutside(dims, shown) {
  const [width, depth, height] = dims;
  const [alongX, alongY] = [depth * height, height];
  let count = 0;
  for (let x = 0, at = 0; x < width; x++) {
    for (let y = 0; y < depth; y++) {
      for (let z = 0; z < height; z++, at++) {
        if (!shown[at]) continue;
        if (
          x === 0 || !shown[at - alongX] || x + 1 === width || !shown[at + alongX] ||
          y === 0 || !shown[at - alongY] || y + 1 === depth || !shown[at + alongY] ||
          (z > 0 && !shown[at - 1]) || z + 1 === height || !shown[at + 1]
        ) {
          count++;
        }
      }
    }
  }
  return count;
}

// Voxels put together to blocks of `edge` voxels: which blocks are shown, and for each the voxel that gives the colour, the
// one that is shown and has the most `weight`.
function blocksOf(dims, shown, weight, edge) {
  const size = dims.map((count) => Math.ceil(count / edge));
  const blocks = new Uint8Array(size[0] * size[1] * size[2]);
  const chosen = new Uint32Array(blocks.length);
  for (let x = 0, at = 0; x < dims[0]; x++) {
    for (let y = 0; y < dims[1]; y++) {
      const column = (Math.floor(x / edge) * size[1] + Math.floor(y / edge)) * size[2];
      for (let z = 0; z < dims[2]; z++, at++) {
        if (!shown[at]) continue;
        const block = column + Math.floor(z / edge);
        if (!blocks[block] || weight[at] > weight[chosen[block]]) chosen[block] = at;
        blocks[block] = 1;
      }
    }
  }
  return { dims: size, shown: blocks, chosen };
}

// Faces of the shown voxels by the side that they look to: left, right, front, back, below, above. Neighbours in a column
// that have the same colour share a face at their sides.
function facesOf(dims, shown, colourOf) {
  const [width, depth, height] = dims;
  const sides = Array.from({ length: 6 }, () => new Faces());
  const columns = [[-1, 0], [1, 0], [0, -1], [0, 1]];
  for (let x = 0; x < width; x++) {
    for (let y = 0; y < depth; y++) {
      const column = (x * depth + y) * height;
      if (!shown.subarray(column, column + height).includes(1)) continue;
      columns.forEach(([dx, dy], side) => {
        const isInside = x + dx >= 0 && x + dx < width && y + dy >= 0 && y + dy < depth;
        const beside = ((x + dx) * depth + y + dy) * height;
        let from = 0;
        let length = 0;
        let colour = 0;
        for (let z = 0; z < height; z++) {
          const isOpen = shown[column + z] && !(isInside && shown[beside + z]);
          const now = isOpen ? colourOf(column + z) : 0;
          if (isOpen && length && now === colour) {
            length++;
            continue;
          }
          if (length) sides[side].push(x, y, from, length, colour);
          [from, length, colour] = [z, isOpen ? 1 : 0, now];
        }
        if (length) sides[side].push(x, y, from, length, colour);
      });
      for (let z = 0; z < height; z++) {
        if (!shown[column + z]) continue;
        if (z > 0 && !shown[column + z - 1]) sides[4].push(x, y, z, 1, colourOf(column + z));
        if (z + 1 === height || !shown[column + z + 1]) sides[5].push(x, y, z, 1, colourOf(column + z));
      }
    }
  }
  return sides;
}
