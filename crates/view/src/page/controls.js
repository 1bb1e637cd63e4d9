// What the user does: pointer, keys, buttons; and the start.

const pointers = new Map();
let grabbed = null;

function pressed(event) {
  const canvas = byId("canvas");
  canvas.setPointerCapture(event.pointerId);
  canvas.focus();
  const place = toFramePlace(event);
  pointers.set(event.pointerId, [event.clientX, event.clientY]);
  if (pointers.size === 2) {
    state.drawing = null;
    grabbed = { pinch: fingerDistance() };
    return;
  }
  if (state.tool === "seed") {
    toTool("move");
    correctReading("seed", place);
  } else if (state.tool === "add") {
    add([subsetAt(place)]);
  } else if (state.tool === "polygon") {
    addCorner(place);
  } else if (state.tool === "move") {
    const index = subsetUnder(place);
    select(index);
    grabbed = index < 0 ? { ground: place } : { index, place, isMoved: false };
  } else {
    state.drawing = { from: place, to: place };
  }
}

function fingerDistance() {
  const [a, b] = [...pointers.values()];
  return Math.hypot(a[0] - b[0], a[1] - b[1]);
}

function moved(event) {
  const place = toFramePlace(event);
  if (!pointers.has(event.pointerId)) {
    hover(place);
    return;
  }
  pointers.set(event.pointerId, [event.clientX, event.clientY]);
  if (grabbed && grabbed.pinch && pointers.size === 2) {
    const distance = fingerDistance();
    zoomBy(distance / grabbed.pinch, place);
    grabbed.pinch = distance;
  } else if (state.drawing) {
    state.drawing.to = place;
    draw();
  } else if (grabbed && grabbed.ground) {
    state.middle = state.middle.map((middle, axis) => middle + grabbed.ground[axis] - place[axis]);
    draw();
    refreshSoon();
  } else if (grabbed && grabbed.index !== undefined) {
    if (!grabbed.isMoved) remember();
    grabbed.isMoved = true;
    moveSelected([place[0] - grabbed.place[0], place[1] - grabbed.place[1]]);
    grabbed.place = place;
  }
}

function hover([x, y]) {
  if (state.info) say(`x ${x.toFixed(1)} px, y ${y.toFixed(1)} px; ${Math.round(100 * state.zoom)} %`);
}

function moveSelected([right, down]) {
  const subset = state.subsets[state.selected];
  if (!subset) return;
  subset.x_px = Math.round(10 * (subset.x_px + right)) / 10;
  subset.y_px = Math.round(10 * (subset.y_px + down)) / 10;
  keepInside(subset);
  changed();
}

function released(event) {
  pointers.delete(event.pointerId);
  const drawing = state.drawing;
  state.drawing = null;
  grabbed = null;
  if (!drawing) return;
  const { from, to } = drawing;
  if (state.tool === "rectangle") {
    const half = [0, 1].map((axis) => Math.round(0.5 * Math.abs(to[axis] - from[axis]) - 0.5));
    if (Math.min(...half) < 2) say("draw a rectangle of at least 5 x 5 px", true);
    else add([subsetAt([0, 1].map((axis) => 0.5 * (from[axis] + to[axis])), half.map((value) => Math.min(value, 250)))]);
  } else if (state.tool === "ruler") {
    layRuler(from, to);
  } else if (Math.hypot(to[0] - from[0], to[1] - from[1]) > 2) {
    add(alongLine(from, to));
  }
  draw();
}

function toTool(tool) {
  state.tool = tool;
  if (tool !== "polygon") state.corners = [];
  for (const input of document.querySelectorAll("input[name=tool]")) input.checked = input.value === tool;
}

const KEYS = {
  ArrowLeft: (event) => (event.altKey ? nudge([-1, 0]) : toFrame(state.frame - (event.shiftKey ? 10 : 1))),
  ArrowRight: (event) => (event.altKey ? nudge([1, 0]) : toFrame(state.frame + (event.shiftKey ? 10 : 1))),
  ArrowUp: (event) => (event.altKey ? nudge([0, -1]) : toFrame(state.frame + 10)),
  ArrowDown: (event) => (event.altKey ? nudge([0, 1]) : toFrame(state.frame - 10)),
  Home: () => toFrame(0),
  End: () => toFrame(state.info.n_frames - 1),
  " ": () => play(!state.playing),
  "+": () => zoomBy(1.25),
  "=": () => zoomBy(1.25),
  "-": () => zoomBy(0.8),
  0: () => { wholeFrame(); draw(); refreshSoon(); },
  t: () => toTrigger(),
  a: () => levels(true).catch(complain),
  n: () => state.subsets.length && select((state.selected + 1) % state.subsets.length),
  r: () => nextDoubtful(1),
  R: () => nextDoubtful(-1),
  x: () => correctReading("exclude"),
  s: () => armSeed(),
  z: () => undo(),
  Delete: () => remove(state.selected),
  Backspace: () => remove(state.selected),
  1: () => toTool("move"),
  2: () => toTool("add"),
  3: () => toTool("rectangle"),
  4: () => toTool("line"),
  5: () => toTool("polygon"),
  Enter: () => closePolygon(),
  Escape: () => { state.corners = []; draw(); },
};

function nudge(step) {
  remember();
  moveSelected(step);
}

function toTrigger() {
  if (state.info.trigger_frame === null) say("no frame lies before the trigger, or none after it", true);
  else toFrame(state.info.trigger_frame);
}

function key(event) {
  // What is written into keeps all keys, sliders and choices their arrows, buttons what presses them.
  const { target } = event;
  const isWritten = target.matches("input:not([type=range], [type=radio], [type=checkbox]), select, textarea");
  const isMoved = target.matches("input[type=range], input[type=radio]") && event.key.startsWith("Arrow");
  const isPressed = target.matches("button, summary, input[type=checkbox], input[type=radio]") && [" ", "Enter"].includes(event.key);
  const action = Object.hasOwn(KEYS, event.key) ? KEYS[event.key] : null;
  if (isWritten || isMoved || isPressed || !action || !state.info || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  action(event);
}

/** Shows another recording of the list. */
async function toRecording(index) {
  play(false);
  state.index = index;
  state.info = null;
  forgetPictures();
  Object.assign(state, { subsets: [], corners: [], ruler: null, selected: -1, undo: [], proposal: null, tracks: [], marked: null, frame: 0, restFrame: 0 });
  say("Opening.");
  try {
    const info = await askJson(address("recording"));
    if (index !== state.index) return;
    state.info = info;
    state.subsets = info.subsets.map((subset) => ({ ...subset }));
    forgetSetUp();
    showFacts(info);
    fitCanvas();
    wholeFrame();
    changed();
    await levels(true);
    await toFrame(0);
    say(`${info.name}: ${info.n_frames} frames`);
  } catch (error) {
    changed();
    complain(error);
  }
}

function showFacts(info) {
  const rate = info.rate_hz ? `${info.rate_hz.toFixed(1)} frames/s` : "no frame rate stated";
  const exposure = info.exposure_s ? `, exposure ${(1e6 * info.exposure_s).toFixed(2)} µs` : "";
  const camera = info.camera ? `, ${info.camera}` : "";
  byId("facts").textContent = `${info.format}, ${info.width_px} x ${info.height_px} px, ${info.bit_depth} bit, ${rate}${exposure}${camera}`;
  for (const id of ["frame", "frame-slider"]) byId(id).max = Math.max(info.n_frames - 1, 0);
  byId("written").textContent = info.points_exist ? `${info.points_path} is there already.` : `Goes to ${info.points_path}.`;
  byId("proposal").textContent = "";
  byId("take").disabled = true;
  showNotes(info.warnings);
}

function showNotes(warnings) {
  const notes = [...state.notes, ...warnings];
  byId("notes").replaceChildren(...notes.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  byId("notes-box").hidden = notes.length === 0;
  byId("notes-box").open = notes.length > 0;
}

function windowMoved() {
  const [level, width] = [Number(byId("level").value), Math.max(Number(byId("window").value), 1)];
  state.low = level - 0.5 * width;
  state.high = level + 0.5 * width;
  showWindow();
  forgetPicturesSoon();
}

const forgetPicturesSoon = later(() => { const before = shown; forgetPictures(); shown = before; refresh(); }, 60);

function connect() {
  const canvas = byId("canvas");
  canvas.addEventListener("pointerdown", pressed);
  canvas.addEventListener("pointermove", moved);
  canvas.addEventListener("pointerup", released);
  canvas.addEventListener("pointercancel", released);
  canvas.addEventListener("dblclick", closePolygon);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-0.0015 * event.deltaY), toFramePlace(event));
  }, { passive: false });
  document.addEventListener("keydown", key);
  const click = (id, action) => byId(id).addEventListener("click", action);
  click("play", () => play(!state.playing));
  click("back", () => toFrame(state.frame - 1));
  click("forth", () => toFrame(state.frame + 1));
  click("trigger", toTrigger);
  click("auto", () => levels(true).catch(complain));
  click("propose", propose);
  click("take", takeProposal);
  click("undo", undo);
  click("clear", () => { remember(); state.subsets = []; state.selected = -1; changed(); });
  click("write", write);
  click("download", download);
  byId("frame-slider").addEventListener("input", (event) => toFrame(Number(event.target.value)));
  byId("frame").addEventListener("change", (event) => toFrame(Number(event.target.value)));
  byId("magnify").addEventListener("input", draw);
  for (const id of ["level", "window"]) byId(id).addEventListener("input", windowMoved);
  for (const input of document.querySelectorAll("input[name=tool]")) input.addEventListener("change", () => toTool(input.value));
  byId("recording").addEventListener("change", (event) => toRecording(Number(event.target.value)));
  new ResizeObserver(() => requestAnimationFrame(() => { fitCanvas(); draw(); refreshSoon(); })).observe(canvas);
}

async function start() {
  connect();
  connectReview();
  try {
    const { title, recordings, notes, has_review: hasReview, has_wave: hasWave, set_up: setUp } = await askJson("/api/recordings");
    state.notes = notes;
    byId("title").textContent = title;
    document.title = `${title} - chainwave view`;
    byId("recording").replaceChildren(...recordings.map((name, i) => new Option(name, i)));
    if (setUp) startSetUp(setUp);
    await toRecording(0);
    if (hasWave) await startWave();
    if (hasReview) await startReview();
  } catch (error) {
    complain(error);
  }
}

start();
