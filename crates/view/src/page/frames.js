// Frames: what part is needed at what scale, and those that came last.

const MOST_KEPT_PIXELS = 4e7;
const kept = new Map();
let keptPixels = 0;
let asking = null;
let shown = null;

/** The region of the frame that the canvas shows, and how many pixels become one, as the server takes them. */
function neededCut() {
  const { width_px: width, height_px: height } = state.info;
  const canvas = byId("canvas");
  let scale = 1;
  while (scale < 64 && scale * 2 * state.zoom <= 1) scale *= 2;
  // Whole tiles, so that small moves of the picture ask nothing.
  const tile = 128 * scale;
  const along = (middle, nDevice, n) => {
    const half = 0.5 * nDevice / state.zoom;
    const first = clamp(Math.floor((middle - half) / tile) * tile, 0, Math.max(n - 1, 0));
    const end = clamp(Math.ceil((middle + half) / tile) * tile, first + 1, n);
    return [first, end - first];
  };
  const [x, w] = along(state.middle[0] + 0.5, canvas.width, width);
  const [y, h] = along(state.middle[1] + 0.5, canvas.height, height);
  return { x, y, w, h, scale };
}

function frameAddress(frame, cut) {
  return address(`frame/${frame}`, { ...cut, low: state.low, high: state.high });
}

/** The picture of a frame, from those that are kept or from the server. */
async function picture(frame, cut, signal) {
  const url = frameAddress(frame, cut);
  const found = kept.get(url);
  if (found) {
    kept.delete(url);
    kept.set(url, found);
    return found;
  }
  const answer = await ask(url, { signal });
  const bitmap = await createImageBitmap(await answer.blob());
  const time = answer.headers.get("X-Time-S");
  const entry = { bitmap, cut, frame, timeS: time === null ? null : Number(time), image: Number(answer.headers.get("X-Image")) };
  kept.set(url, entry);
  keptPixels += bitmap.width * bitmap.height;
  for (const [old, { bitmap: gone }] of kept) {
    if (keptPixels < MOST_KEPT_PIXELS || kept.size < 4) break;
    kept.delete(old);
    keptPixels -= gone.width * gone.height;
  }
  return entry;
}

function forgetPictures() {
  kept.clear();
  keptPixels = 0;
  shown = null;
}

/** Shows the frame of the state; true when it did, false when another one was asked for meanwhile. */
async function refresh() {
  if (!state.info || !state.info.n_frames) return false;
  const [index, frame, cut] = [state.index, state.frame, neededCut()];
  if (asking) asking.abort();
  asking = new AbortController();
  try {
    const entry = await picture(frame, cut, asking.signal);
    if (index !== state.index || frame !== state.frame) return false;
    shown = entry;
    state.timeS = entry.timeS;
    state.image = entry.image;
    if (state.info.n_tracks) {
      const { tracks } = await askJson(address(`tracks/${frame}`));
      if (frame === state.frame) state.tracks = tracks;
    }
    showTime();
    draw();
    followFrame();
    const next = frame + 1;
    if (next < state.info.n_frames) picture(next, cut).catch(() => {});
    return true;
  } catch (error) {
    complain(error);
    return false;
  }
}

const refreshSoon = later(refresh, 30);

function showTime() {
  const time = state.timeS === null ? "no time" : `t = ${(1e3 * state.timeS).toFixed(4)} ms`;
  const unit = state.info.rate_hz ? time : `${time} (no frame rate is stated)`;
  byId("time").textContent = `of ${state.info.n_frames}, image ${state.image}, ${unit}`;
}

function toFrame(frame) {
  if (!state.info) return Promise.resolve(false);
  state.frame = clamp(Math.round(frame) || 0, 0, state.info.n_frames - 1);
  byId("frame").value = state.frame;
  byId("frame-slider").value = state.frame;
  return refresh();
}

async function play(on) {
  state.playing = on;
  byId("play").textContent = on ? "Stop" : "Play";
  byId("play").setAttribute("aria-pressed", on);
  while (state.playing) {
    const start = performance.now();
    const next = state.frame + 1 < state.info.n_frames ? state.frame + 1 : 0;
    await toFrame(next);
    const rest = 1000 / Number(byId("speed").value) - (performance.now() - start);
    await new Promise((resolve) => setTimeout(resolve, Math.max(rest, 0)));
  }
}

/** The histogram of the frame, and with `take` a window that fits it. */
async function levels(take) {
  const found = await askJson(address(`levels/${state.frame}`));
  const most = Math.log1p(Math.max(...found.bars, 1));
  const n = found.bars.length;
  const bars = found.bars.map((bar, i) => {
    const height = 46 * Math.log1p(bar) / most;
    return `M${256 * i / n} 48v${-height}h${256 / n}v${height}z`;
  });
  byId("bars").setAttribute("d", bars.join(""));
  const per = (count) => (100 * count / Math.max(found.n_pixels, 1)).toFixed(count ? 2 : 0);
  byId("clipped").textContent = `${per(found.n_saturated)} % of the pixels saturate, ${per(found.n_dark)} % are at count 0.`;
  byId("clipped").classList.toggle("bad", found.n_saturated > 0.01 * found.n_pixels);
  if (take) {
    state.low = found.low;
    state.high = found.high;
    showWindow();
    forgetPictures();
    await refresh();
  }
}

function showWindow() {
  const full = state.info.full_scale;
  const [level, width] = [byId("level"), byId("window")];
  level.max = full;
  width.max = full;
  level.value = 0.5 * (state.low + state.high);
  width.value = state.high - state.low;
  byId("level-value").textContent = `${Math.round(level.value)}`;
  byId("window-value").textContent = `${Math.round(width.value)}: black at ${Math.round(state.low)}, white at ${Math.round(state.high)}`;
}
