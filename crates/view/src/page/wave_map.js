// A map of strain over time and gap, whose cursor is linked to the profile and the histories. It stands by itself: a report has it without a server.

const wave = { data: null, instant: 0, row: 0, image: null, most: 0, whenMoved: () => {} };
const waveBox = (id) => document.getElementById(id);
const within = (value, n) => Math.min(Math.max(Math.round(value), 0), n - 1);

/** Shows a wave; `whenMoved` is told the time in seconds to which the user moves the cursor. */
function showWave(data, whenMoved = () => {}) {
  const { strain, times_s: times } = data;
  if (!strain.length || !times.length) return;
  for (const row of strain) for (const value of row) wave.most = Math.max(wave.most, Math.abs(value || 0));
  wave.most = wave.most || 1;
  wave.data = data;
  wave.whenMoved = whenMoved;
  wave.image = mapOf(strain, times.length);
  waveBox("wave").hidden = false;
  sayScale();
  connectWave();
  new ResizeObserver(drawWave).observe(waveBox("map"));
  toStrongest();
}

/** Begins where the strain is largest: there is something to see. */
function toStrongest() {
  const { strain } = wave.data;
  strain.forEach((row, gap) => row.forEach((value, i) => { if (Math.abs(value) === wave.most) [wave.row, wave.instant] = [gap, i]; }));
  drawWave();
}

function sayScale() {
  const { strain, times_s: times } = wave.data;
  const ms = (time) => (1e3 * time).toFixed(2);
  waveBox("map-extent").textContent = `${ms(times[0])} to ${ms(times[times.length - 1])} ms to the right, gap 1 to ${strain.length} downwards; red is compression, grey not measured`;
  waveBox("map-least").textContent = `strain ${(-wave.most).toPrecision(2)}`;
  waveBox("map-most").textContent = `+${wave.most.toPrecision(2)}`;
}

/** From none to the largest strain, as the figures of a report have them: red is compression, blue tension. */
const COMPRESSION = [[255, 255, 255], [196, 98, 66], [74, 16, 6]];
const TENSION = [[255, 255, 255], [98, 146, 212], [20, 48, 120]];
const NOT_MEASURED = [128, 128, 128];

function colourOf(value) {
  if (value === null) return NOT_MEASURED;
  const colours = value < 0 ? COMPRESSION : TENSION;
  const place = Math.min(Math.abs(value) / wave.most, 1) * (colours.length - 1);
  const before = Math.min(Math.floor(place), colours.length - 2);
  return [0, 1, 2].map((c) => Math.round(colours[before][c] + (place - before) * (colours[before + 1][c] - colours[before][c])));
}

function mapOf(strain, n) {
  const canvas = document.createElement("canvas");
  canvas.width = n;
  canvas.height = strain.length;
  const context = canvas.getContext("2d");
  const image = context.createImageData(n, strain.length);
  strain.forEach((row, gap) => row.forEach((value, i) => image.data.set([...colourOf(value), 255], 4 * (gap * n + i))));
  context.putImageData(image, 0, 0);
  return canvas;
}

function fitted(id) {
  const canvas = waveBox(id);
  const [box, ratio] = [canvas.getBoundingClientRect(), window.devicePixelRatio || 1];
  canvas.width = Math.max(1, Math.round(box.width * ratio));
  canvas.height = Math.max(1, Math.round(box.height * ratio));
  return canvas;
}

/** A curve of values over 0 to 1, drawn into a canvas, with a mark at one of them. */
function curve(id, values, marked, title) {
  const canvas = fitted(id);
  const context = canvas.getContext("2d");
  const style = getComputedStyle(document.body);
  const known = values.filter((value) => value !== null);
  const [low, high] = [Math.min(0, ...known), Math.max(0, ...known)];
  const span = high - low || 1;
  const x = (i) => 4 + (canvas.width - 8) * (values.length > 1 ? i / (values.length - 1) : 0.5);
  const y = (value) => 16 + (canvas.height - 22) * (high - value) / span;
  context.strokeStyle = style.getPropertyValue("--line");
  context.beginPath(); context.moveTo(0, y(0)); context.lineTo(canvas.width, y(0)); context.moveTo(x(marked), 14); context.lineTo(x(marked), canvas.height); context.stroke();
  context.strokeStyle = style.getPropertyValue("--accent");
  context.lineWidth = 1.5;
  context.beginPath();
  let isDrawing = false;
  values.forEach((value, i) => {
    if (value === null) { isDrawing = false; return; }
    if (isDrawing) context.lineTo(x(i), y(value)); else context.moveTo(x(i), y(value));
    isDrawing = true;
  });
  context.stroke();
  context.fillStyle = style.getPropertyValue("--ink");
  context.font = `${11 * (window.devicePixelRatio || 1)}px system-ui, sans-serif`;
  context.fillText(`${title}: ${low.toPrecision(2)} to ${high.toPrecision(2)}`, 4, 11 * (window.devicePixelRatio || 1));
}

function drawWave() {
  if (!wave.data || !wave.image) return;
  const { strain, displacement_m: moved, times_s: times } = wave.data;
  const map = fitted("map");
  const context = map.getContext("2d");
  context.imageSmoothingEnabled = false;
  context.drawImage(wave.image, 0, 0, map.width, map.height);
  const [x, y] = [map.width * (wave.instant + 0.5) / times.length, map.height * (wave.row + 0.5) / strain.length];
  context.strokeStyle = "#000000";
  context.lineWidth = window.devicePixelRatio || 1;
  context.beginPath(); context.moveTo(x, 0); context.lineTo(x, map.height); context.moveTo(0, y); context.lineTo(map.width, y); context.stroke();
  curve("profile", strain.map((row) => row[wave.instant]), wave.row, "strain along the chain");
  curve("history", strain[wave.row], wave.instant, `strain of gap ${wave.row + 1}`);
  curve("motion", moved[wave.row] || [], wave.instant, `displacement of body ${wave.row + 1} (m)`);
  const value = strain[wave.row][wave.instant];
  waveBox("cursor").textContent = `t = ${(1e3 * times[wave.instant]).toFixed(3)} ms, gap ${wave.row + 1}: ${value === null ? "not measured" : `strain ${value}`}`;
}

/** Moves the cursor. */
function toInstant(instant, row) {
  if (!wave.data) return;
  wave.instant = within(instant, wave.data.times_s.length);
  wave.row = within(row, wave.data.strain.length);
  drawWave();
}

function moveWave(instant, row) {
  toInstant(instant, row);
  wave.whenMoved(wave.data.times_s[wave.instant]);
}

function connectWave() {
  // The colours of the curves are those of the page.
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawWave);
  const map = waveBox("map");
  const at = (event) => {
    const box = map.getBoundingClientRect();
    const share = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    moveWave(share[0] * wave.data.times_s.length - 0.5, share[1] * wave.data.strain.length - 0.5);
  };
  map.addEventListener("pointerdown", (event) => { map.setPointerCapture(event.pointerId); at(event); });
  map.addEventListener("pointermove", (event) => { if (event.buttons) at(event); });
  map.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    const many = event.shiftKey ? 10 : 1;
    moveWave(wave.instant + many * step[0], wave.row + many * step[1]);
  });
}
