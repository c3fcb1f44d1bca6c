// Places the parts of a flow in columns, each right of what feeds it, and the lines between them. Pure functions.

/**
 * @typedef {{source: string, target: string}} Line
 * @typedef {{x: number, y: number}} Point
 * @typedef {{name: string, x: number, y: number, height: number}} Box `y`: of its top
 * @typedef {{line: number, path: string, end: Point}} Route `line`: index of the line; `end`: where it arrives
 * @typedef {{width: number, height: number, boxes: Box[], routes: Route[]}} Layout
 * @typedef {{name: string, column: number, line: number | null, before: Cell[], after: Cell[], y: number, height: number}} Cell
 *   a part, or (`line`) the place of a line in a column that it crosses
 */

export const BOX = Object.freeze({ width: 132, height: 42, port: 15 });
const GAP = Object.freeze({ column: 78, row: 12 });
const LANE_HEIGHT = 4;
const SWEEPS = 6;

/**
 * Place the ends of all lines; the same lines are always placed alike.
 * @param {Line[]} lines
 * @returns {Layout}
 */
export function layered(lines) {
  const columns = columnsOf(lines);
  const { cells, chains } = cellsOf(lines, columns);
  const grid = gridOf(cells);
  for (let sweep = 0; sweep < SWEEPS; sweep++) sortColumns(grid, sweep % 2 === 0);
  const height = placeRows(grid);
  const boxes = cells.filter(({ line }) => line === null).map((cell) => boxOf(cell));
  const width = Math.max(0, ...boxes.map(({ x }) => x + BOX.width));
  return { width, height, boxes, routes: chains.map((chain, line) => routeOf(chain, line, chains)) };
}

/**
 * Return the column of each part: right of all that feed it, what nothing feeds beside what it feeds.
 * @param {Line[]} lines
 * @returns {Map<string, number>}
 */
export function columnsOf(lines) {
  const names = [...new Set(lines.flatMap(({ source, target }) => [source, target]))].sort();
  const forward = withoutCycles(names, lines);
  /** @type {Map<string, number>} */
  const columns = new Map();
  /** @type {(name: string) => number} */
  const columnOf = (name) => {
    const known = columns.get(name);
    if (known !== undefined) return known;
    const feeding = forward.filter(({ target }) => target === name).map(({ source }) => columnOf(source));
    const column = feeding.length > 0 ? Math.max(...feeding) + 1 : 0;
    columns.set(name, column);
    return column;
  };
  names.forEach(columnOf);
  for (const name of names) {
    const fed = forward.filter(({ source }) => source === name).map(({ target }) => columns.get(target) ?? 0);
    if (fed.length > 0 && !forward.some(({ target }) => target === name)) columns.set(name, Math.min(...fed) - 1);
  }
  return columns;
}

/**
 * Return the lines without those that lead back.
 * @param {string[]} names
 * @param {Line[]} lines
 */
function withoutCycles(names, lines) {
  /** @type {Set<Line>} */
  const back = new Set();
  /** @type {Set<string>} */
  const ended = new Set();
  const follow = (/** @type {string} */ name, /** @type {string[]} */ way) => {
    if (ended.has(name)) return;
    for (const line of lines.filter(({ source }) => source === name)) {
      if ([...way, name].includes(line.target)) back.add(line);
      else follow(line.target, [...way, name]);
    }
    ended.add(name);
  };
  names.forEach((name) => follow(name, []));
  return lines.filter((line) => !back.has(line));
}

/** @param {Line[]} lines @param {Map<string, number>} columns */
function cellsOf(lines, columns) {
  /** @type {Map<string, Cell>} */
  const parts = new Map([...columns].map(([name, column]) => [name, cell(name, column, null)]));
  const lanes = /** @type {Cell[]} */ ([]);
  const chains = lines.map(({ source, target }, line) => {
    const [from, to] = [/** @type {Cell} */ (parts.get(source)), /** @type {Cell} */ (parts.get(target))];
    const crossed = [];
    for (let column = from.column + 1; column < to.column; column++) crossed.push(cell("", column, line));
    lanes.push(...crossed);
    const chain = [from, ...crossed, to];
    chain.slice(1).forEach((after, index) => {
      const before = /** @type {Cell} */ (chain[index]);
      before.after.push(after);
      after.before.push(before);
    });
    return chain;
  });
  for (const part of parts.values()) {
    const ports = Math.max(part.before.length, part.after.length);
    part.height = Math.max(BOX.height, BOX.port * (ports + 1));
  }
  return { cells: [...parts.values(), ...lanes], chains };
}

/** @param {string} name @param {number} column @param {number | null} line @returns {Cell} */
function cell(name, column, line) {
  return { name, column, line, before: [], after: [], y: 0, height: LANE_HEIGHT };
}

/** @param {Cell[]} cells @returns {Cell[][]} */
function gridOf(cells) {
  /** @type {Cell[][]} */
  const grid = Array.from({ length: Math.max(-1, ...cells.map(({ column }) => column)) + 1 }, () => []);
  for (const one of cells) grid[one.column]?.push(one);
  return grid;
}

/** Sort each column by the middle of its neighbours, so that few lines cross. @param {Cell[][]} grid @param {boolean} rightwards */
function sortColumns(grid, rightwards) {
  const order = new Map(grid.flatMap((column) => column.map((one, index) => [one, (index + 0.5) / column.length])));
  const middle = (/** @type {Cell} */ one) => {
    const beside = rightwards ? one.before : one.after;
    const places = beside.map((other) => order.get(other) ?? 0.5);
    return places.length > 0 ? places.reduce((sum, at) => sum + at, 0) / places.length : (order.get(one) ?? 0.5);
  };
  for (const column of rightwards ? grid : [...grid].reverse()) {
    const wanted = new Map(column.map((one) => [one, middle(one)]));
    column.sort((a, b) => (wanted.get(a) ?? 0) - (wanted.get(b) ?? 0));
    column.forEach((one, index) => order.set(one, (index + 0.5) / column.length));
  }
}

/** Give each cell its place in its column, all columns about one middle; return the height. @param {Cell[][]} grid */
function placeRows(grid) {
  const heights = grid.map((column) => column.reduce((sum, { height }) => sum + height + GAP.row, -GAP.row));
  const tallest = Math.max(0, ...heights);
  grid.forEach((column, index) => {
    let y = (tallest - (heights[index] ?? 0)) / 2;
    for (const one of column) {
      one.y = y;
      y += one.height + GAP.row;
    }
  });
  return tallest;
}

/** @param {number} column */
const leftOf = (column) => column * (BOX.width + GAP.column);

/** @param {Cell} cell @returns {Box} */
function boxOf({ name, column, y, height }) {
  return { name, x: leftOf(column), y, height };
}

/**
 * Return the way of a line: it leaves and reaches a part at a place of its own, and crosses columns straight.
 * @param {Cell[]} chain @param {number} line @param {Cell[][]} chains
 * @returns {Route}
 */
function routeOf(chain, line, chains) {
  const [from, to] = [/** @type {Cell} */ (chain[0]), /** @type {Cell} */ (chain.at(-1))];
  const start = { x: leftOf(from.column) + BOX.width, y: portOf(from, line, chains, false) };
  const end = { x: leftOf(to.column), y: portOf(to, line, chains, true) };
  let path = `M${start.x} ${start.y}`;
  let last = start;
  for (const crossed of chain.slice(1, -1)) {
    const at = { x: leftOf(crossed.column), y: crossed.y + LANE_HEIGHT / 2 };
    path += `${bow(last, at)}H${at.x + BOX.width}`;
    last = { x: at.x + BOX.width, y: at.y };
  }
  return { line, path: path + bow(last, end), end };
}

/** @param {Point} from @param {Point} to */
function bow(from, to) {
  const reach = Math.max(Math.abs(to.x - from.x) / 2, GAP.column / 2);
  return `C${from.x + reach} ${from.y} ${to.x - reach} ${to.y} ${to.x} ${to.y}`;
}

/**
 * Return the height at which a line reaches or leaves a part: those of upper neighbours above the others.
 * @param {Cell} part @param {number} line @param {Cell[][]} chains @param {boolean} arriving
 */
function portOf(part, line, chains, arriving) {
  const beside = (/** @type {Cell[]} */ chain) => (arriving ? chain.at(-2) : chain[1]);
  const own = chains
    .map((chain, index) => ({ index, chain }))
    .filter(({ chain }) => (arriving ? chain.at(-1) : chain[0]) === part)
    .sort((a, b) => (beside(a.chain)?.y ?? 0) - (beside(b.chain)?.y ?? 0) || a.index - b.index);
  const place = own.findIndex(({ index }) => index === line);
  return part.y + part.height / 2 + BOX.port * (place - (own.length - 1) / 2);
}
