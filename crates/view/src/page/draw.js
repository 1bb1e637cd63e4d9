// The canvas: the frame, and what lies on it. Pixel (0, 0) of a frame is the centre of its top left one.

const COLOURS = { subset: "#ffb000", selected: "#ff5e5e", proposed: "#39c5ff", track: "#6fe07a", missing: "#ff5e5e" };

const toScreen = ([x, y]) => {
  const canvas = byId("canvas");
  return [(x - state.middle[0]) * state.zoom + 0.5 * canvas.width, (y - state.middle[1]) * state.zoom + 0.5 * canvas.height];
};

/** The place in the frame under a pointer. */
function toFramePlace(event) {
  const canvas = byId("canvas");
  const box = canvas.getBoundingClientRect();
  const ratio = canvas.width / box.width;
  const [u, v] = [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
  return [(u - 0.5 * canvas.width) / state.zoom + state.middle[0], (v - 0.5 * canvas.height) / state.zoom + state.middle[1]];
}

function fitCanvas() {
  const canvas = byId("canvas");
  const box = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [Math.max(1, Math.round(box.width * ratio)), Math.max(1, Math.round(box.height * ratio))];
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
}

function wholeFrame() {
  const canvas = byId("canvas");
  const { width_px: width, height_px: height } = state.info;
  state.zoom = Math.min(canvas.width / width, canvas.height / height) * 0.98;
  state.middle = [0.5 * (width - 1), 0.5 * (height - 1)];
}

/** Zooms by a factor about a place of the frame that stays where it is. */
function zoomBy(factor, place = state.middle) {
  const zoom = clamp(state.zoom * factor, 1 / 64, 64);
  const share = 1 - state.zoom / zoom;
  state.middle = state.middle.map((middle, axis) => middle + (place[axis] - middle) * share);
  state.zoom = zoom;
  draw();
  refreshSoon();
}

/** A line through places of the frame. */
function trace(context, places, colour, isClosed) {
  if (!places.length) return;
  for (const [width, stroke] of [[4, "rgba(0, 0, 0, 0.55)"], [2, colour]]) {
    context.lineWidth = width;
    context.strokeStyle = stroke;
    context.beginPath();
    places.map(toScreen).forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (isClosed) context.closePath();
    context.stroke();
  }
}

/** The corners of a subset's outline in the frame. */
const outlineOf = (subset) => (subset.outline_px || []).map(([x, y]) => [subset.x_px + x, subset.y_px + y]);

/** A rectangle of whole pixels around a centre. */
function box(context, [x, y], [halfWidth, halfHeight], colour, text, dashed = false) {
  const [centreX, centreY] = [Math.round(x), Math.round(y)];
  const [left, top] = toScreen([centreX - halfWidth - 0.5, centreY - halfHeight - 0.5]);
  const [right, bottom] = toScreen([centreX + halfWidth + 0.5, centreY + halfHeight + 0.5]);
  context.setLineDash(dashed ? [6, 4] : []);
  for (const [width, stroke] of [[4, "rgba(0, 0, 0, 0.55)"], [2, colour]]) {
    context.lineWidth = width;
    context.strokeStyle = stroke;
    context.strokeRect(left, top, right - left, bottom - top);
  }
  context.setLineDash([]);
  if (text) label(context, text, left, top - 4, colour);
}

function label(context, text, x, y, colour) {
  context.font = `${12 * (window.devicePixelRatio || 1)}px system-ui, sans-serif`;
  context.lineWidth = 3;
  context.strokeStyle = "rgba(0, 0, 0, 0.75)";
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

function cross(context, place, colour) {
  const [x, y] = toScreen(place);
  context.lineWidth = 2;
  context.strokeStyle = colour;
  context.beginPath();
  context.moveTo(x - 7, y - 7); context.lineTo(x + 7, y + 7);
  context.moveTo(x - 7, y + 7); context.lineTo(x + 7, y - 7);
  context.stroke();
}

function draw() {
  const canvas = byId("canvas");
  const context = canvas.getContext("2d");
  context.clearRect(0, 0, canvas.width, canvas.height);
  if (!state.info) return;
  if (shown) {
    const { bitmap, cut } = shown;
    const [left, top] = toScreen([cut.x - 0.5, cut.y - 0.5]);
    context.imageSmoothingEnabled = state.zoom * cut.scale < 1;
    const size = cut.scale * state.zoom;
    context.drawImage(bitmap, left, top, bitmap.width * size, bitmap.height * size);
  }
  const factor = clamp(Number(byId("magnify").value) || 1, 1, 1000);
  for (const { name, half_px: half, place_px: place, rest_px: rest } of state.tracks) {
    if (!place) continue;
    const shownAt = rest ? place.map((value, axis) => rest[axis] + factor * (value - rest[axis])) : place;
    box(context, shownAt, half, name === state.marked ? COLOURS.selected : COLOURS.track, name);
  }
  if (state.proposal) {
    for (const { subset, number, sigma } of state.proposal.markers) {
      const text = sigma.sigma_px ? `${number}: ${Math.max(...sigma.sigma_px).toFixed(4)} px` : `${number}: ${sigma.reason}`;
      box(context, [subset.x_px, subset.y_px], [subset.half_width_px, subset.half_height_px], COLOURS.proposed, text, true);
    }
    for (const place of state.proposal.missing_px || []) cross(context, place, COLOURS.missing);
  }
  state.subsets.forEach((subset, i) => {
    const colour = i === state.selected ? COLOURS.selected : COLOURS.subset;
    const outline = outlineOf(subset);
    box(context, [subset.x_px, subset.y_px], [subset.half_width_px, subset.half_height_px], colour, subset.name, outline.length > 0);
    trace(context, outline, colour, true);
  });
  trace(context, state.corners, COLOURS.selected, false);
  if (state.ruler) trace(context, state.ruler, COLOURS.proposed, false);
  if (state.drawing) drawUnfinished(context);
}

function drawUnfinished(context) {
  const { from, to } = state.drawing;
  const [[left, top], [right, bottom]] = [toScreen(from), toScreen(to)];
  context.lineWidth = 2;
  context.strokeStyle = COLOURS.selected;
  if (state.tool === "rectangle") {
    context.strokeRect(left, top, right - left, bottom - top);
  } else if (state.tool === "ruler") {
    trace(context, [from, to], COLOURS.proposed, false);
  } else if (state.tool === "line") {
    for (const subset of alongLine(from, to)) box(context, [subset.x_px, subset.y_px], [subset.half_width_px, subset.half_height_px], COLOURS.selected, "");
  }
}
