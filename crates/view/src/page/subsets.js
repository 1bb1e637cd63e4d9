// Subsets: made, moved, deleted, listed with their expected sigma, proposed, written.

function remember() {
  state.undo.push(JSON.stringify(state.subsets));
  if (state.undo.length > 100) state.undo.shift();
}

function undo() {
  const before = state.undo.pop();
  if (before === undefined) return;
  state.subsets = JSON.parse(before);
  state.selected = -1;
  changed();
}

/** The smallest number that names no subset yet. */
function freeName() {
  const names = new Set(state.subsets.map((subset) => subset.name));
  let number = 1;
  while (names.has(String(number))) number += 1;
  return String(number);
}

const wantedHalf = () => ["half-width", "half-height"].map((id) => clamp(Math.round(Number(byId(id).value)) || 16, 2, 250));

/** Moves a subset so that all of it lies in the frame; false when it is larger than that. */
function keepInside(subset) {
  const { width_px: width, height_px: height } = state.info;
  const [halfWidth, halfHeight] = [subset.half_width_px, subset.half_height_px];
  if (2 * halfWidth + 1 > width || 2 * halfHeight + 1 > height) return false;
  subset.x_px = clamp(subset.x_px, halfWidth, width - 1 - halfWidth);
  subset.y_px = clamp(subset.y_px, halfHeight, height - 1 - halfHeight);
  return true;
}

function subsetAt([x, y], [halfWidth, halfHeight] = wantedHalf()) {
  const tenth = (value) => Math.round(10 * value) / 10;
  return { name: "", x_px: tenth(x), y_px: tenth(y), half_width_px: halfWidth, half_height_px: halfHeight, outline_px: [] };
}

/** A corner more of the polygon that is drawn; the second of a double click is the first once more. */
function addCorner(place) {
  const last = state.corners[state.corners.length - 1];
  if (last && Math.hypot(place[0] - last[0], place[1] - last[1]) * state.zoom < 4) return;
  state.corners.push(place);
  draw();
}

/** The subset within the polygon that was drawn. */
function closePolygon() {
  const corners = state.corners;
  if (state.tool !== "polygon" || !corners.length) return;
  state.corners = [];
  const ends = [0, 1].map((axis) => corners.map((corner) => corner[axis])).map((values) => [Math.min(...values), Math.max(...values)]);
  const half = ends.map(([least, most]) => Math.ceil(0.5 * (most - least)));
  if (corners.length < 3 || Math.min(...half) < 2 || Math.max(...half) > 250) {
    say("a polygon has at least three corners, and 5 to 501 columns and rows", true);
  } else {
    const subset = subsetAt(ends.map(([least, most]) => 0.5 * (least + most)), half);
    const tenth = (value) => Math.round(10 * value) / 10;
    add([{ ...subset, outline_px: corners.map(([x, y]) => [tenth(x - subset.x_px), tenth(y - subset.y_px)]) }]);
  }
  draw();
}

function add(subsets) {
  remember();
  let outside = 0;
  for (const subset of subsets) {
    subset.name = subset.name || freeName();
    if (keepInside(subset)) state.subsets.push(subset); else outside += 1;
  }
  state.selected = state.subsets.length - 1;
  if (outside) say(`${outside} subset(s) larger than the frame were left out; make the half width or height smaller`, true);
  changed();
}

function remove(index) {
  if (index < 0 || index >= state.subsets.length) return;
  remember();
  state.subsets.splice(index, 1);
  state.selected = Math.min(index, state.subsets.length - 1);
  changed();
}

/** Subsets at equal distances from one place to another. */
function alongLine(from, to) {
  const n = clamp(Math.round(Number(byId("n-line").value)) || 2, 2, 500);
  return Array.from({ length: n }, (_, i) => subsetAt([0, 1].map((axis) => from[axis] + (to[axis] - from[axis]) * i / (n - 1))));
}

/** The subset under a place, the last drawn first. */
function subsetUnder([x, y]) {
  for (let i = state.subsets.length - 1; i >= 0; i -= 1) {
    const subset = state.subsets[i];
    if (Math.abs(x - subset.x_px) <= subset.half_width_px + 1 && Math.abs(y - subset.y_px) <= subset.half_height_px + 1) return i;
  }
  return -1;
}

function select(index) {
  state.selected = index;
  document.querySelectorAll("#list tr").forEach((row, i) => row.setAttribute("aria-selected", i === index));
  draw();
}

/** Asks for the expected sigma of subsets that have none yet. */
const findSigmas = later(async () => {
  for (const subset of state.subsets.slice()) {
    const outline = (subset.outline_px || []).flat().join(" ");
    const key = [state.index, subset.x_px, subset.y_px, subset.half_width_px, subset.half_height_px, outline].join(" ");
    if (subset.sigmaKey === key) continue;
    subset.sigmaKey = key;
    try {
      const parameters = { x: subset.x_px, y: subset.y_px, half_width: subset.half_width_px, half_height: subset.half_height_px, outline };
      subset.sigma = await askJson(address(`sigma/${state.restFrame}`, parameters));
    } catch (error) {
      subset.sigma = { sigma_px: null, reason: error.message };
    }
    list();
  }
}, 120);

function sigmaText({ sigma }) {
  if (!sigma) return "…";
  return sigma.sigma_px ? sigma.sigma_px.map((value) => value.toFixed(4)).join(", ") : sigma.reason;
}

function list() {
  const body = byId("list");
  const focused = document.activeElement && document.activeElement.dataset ? document.activeElement.dataset.key : undefined;
  body.replaceChildren();
  state.subsets.forEach((subset, i) => {
    const row = document.createElement("tr");
    row.setAttribute("aria-selected", i === state.selected);
    const name = document.createElement("input");
    name.value = subset.name;
    name.dataset.key = `name ${i}`;
    name.setAttribute("aria-label", `name of subset ${i + 1}`);
    name.addEventListener("change", () => rename(i, name));
    const cells = [name, fixed(subset.x_px, 1), fixed(subset.y_px, 1), `${subset.half_width_px} x ${subset.half_height_px}`, sigmaText(subset)];
    const gone = document.createElement("button");
    gone.textContent = "×";
    gone.dataset.key = `delete ${i}`;
    gone.setAttribute("aria-label", `delete subset ${subset.name}`);
    gone.addEventListener("click", (event) => { event.stopPropagation(); remove(i); });
    for (const content of [...cells, gone]) {
      const cell = document.createElement("td");
      cell.append(content);
      row.append(cell);
    }
    row.addEventListener("click", () => select(i));
    body.append(row);
  });
  if (focused) for (const element of body.querySelectorAll("[data-key]")) if (element.dataset.key === focused) element.focus();
}

function rename(index, input) {
  const name = input.value.trim();
  const taken = state.subsets.some((subset, i) => i !== index && subset.name === name);
  if (!name || taken) {
    say(`a name for each subset, each once: found ${JSON.stringify(name)}`, true);
    input.value = state.subsets[index].name;
    return;
  }
  remember();
  state.subsets[index].name = name;
  changed();
}

/** Everything that follows from the subsets. */
function changed() {
  const any = state.subsets.length > 0;
  for (const id of ["write", "download", "clear"]) byId(id).disabled = !any;
  byId("undo").disabled = state.undo.length === 0;
  byId("spacing").textContent = spacingText();
  list();
  draw();
  findSigmas();
}

/** How far apart neighbours are, in the order of the list. */
function spacingText() {
  const places = state.subsets.map(({ x_px: x, y_px: y }) => [x, y]);
  if (places.length < 2) return "";
  const steps = places.slice(1).map(([x, y], i) => Math.hypot(x - places[i][0], y - places[i][1]));
  const mean = steps.reduce((sum, step) => sum + step, 0) / steps.length;
  return `From one subset to the next: ${mean.toFixed(1)} px on average, ${Math.min(...steps).toFixed(1)} to ${Math.max(...steps).toFixed(1)} px.`;
}

async function propose() {
  byId("proposal").textContent = "Looking for markers.";
  try {
    const found = await askJson(address("markers", { frame: state.restFrame }));
    state.proposal = found;
    byId("take").disabled = found.markers.length === 0;
    byId("proposal").textContent = proposalText(found);
    draw();
  } catch (error) {
    byId("proposal").textContent = error.message;
  }
}

function proposalText(found) {
  if (!found.markers.length) return found.reason;
  const { subset } = found.markers[0];
  const parts = [`${found.markers.length} marker(s), subsets of half width ${subset.half_width_px} and half height ${subset.half_height_px} px`];
  if (found.pitch_px) {
    const angle = (180 / Math.PI) * Math.atan2(found.direction[1], found.direction[0]);
    parts.push(`pitch ${found.pitch_px[0].toFixed(2)} ± ${found.pitch_px[1].toFixed(2)} px, ${angle.toFixed(1)}° from the rows`);
  }
  if (found.missing_px.length) parts.push(`${found.missing_px.length} place(s) without a marker`);
  parts.push(`noise ${found.noise_counts.toFixed(1)} counts, over ${found.n_rest} frame(s) at rest`);
  return parts.join("; ") + ".";
}

function takeProposal() {
  if (!state.proposal) return;
  const all = state.proposal.markers.map(({ subset, sigma }) => ({ ...subset, sigma }));
  const taken = all.filter((subset) => subsetUnder([subset.x_px, subset.y_px]) < 0);
  if (taken.length < all.length) say(`${all.length - taken.length} marker(s) have a subset already`);
  remember();
  const free = new Set(state.subsets.map((subset) => subset.name));
  for (const subset of taken) {
    if (free.has(subset.name)) subset.name = freeName();
    free.add(subset.name);
    state.subsets.push(subset);
  }
  state.proposal = null;
  byId("take").disabled = true;
  changed();
}

const plain = ({ name, x_px, y_px, half_width_px, half_height_px, outline_px: outline }) => ({ name, x_px, y_px, half_width_px, half_height_px, outline_px: outline || [] });

async function write() {
  const overwrite = byId("overwrite").checked;
  const options = { method: "PUT", body: JSON.stringify({ points: state.subsets.map(plain) }) };
  const box = byId("written");
  try {
    const { path, n_points: n } = await askJson(address("points", { overwrite }), options);
    box.textContent = `wrote ${path}: ${n} subsets. Next: chainwave track RECORDING --points ${path} --out tracks.csv`;
    box.classList.remove("bad");
    byId("overwrite").checked = false;
  } catch (error) {
    box.textContent = error.status === 409 ? `${error.message}. Tick “replace the file that is there” to do so.` : error.message;
    box.classList.add("bad");
  }
}

function download() {
  const cell = (text) => (/[,;"]/.test(text) || text.trim() !== text ? `"${text.replaceAll('"', '""')}"` : text);
  const hasOutline = state.subsets.some((s) => s.outline_px && s.outline_px.length);
  const outline = (s) => (hasOutline ? [(s.outline_px || []).flat().join(" ")] : []);
  const rows = state.subsets.map((s) => [cell(s.name), s.x_px, s.y_px, s.half_width_px, s.half_height_px, ...outline(s)].join(","));
  const text = [`name,x_px,y_px,half_width_px,half_height_px${hasOutline ? ",outline_px" : ""}`, ...rows, ""].join("\n");
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = "points.csv";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
