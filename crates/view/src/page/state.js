"use strict";
// What the page knows, how it asks the server, and small helpers.

const token = new URLSearchParams(location.search).get("token") || "";
const byId = (id) => document.getElementById(id);

const state = {
  index: 0,
  notes: [],
  // The first of the frames at rest, which markers and sigma are found in.
  restFrame: 0,
  info: null,
  frame: 0,
  timeS: null,
  image: null,
  playing: false,
  // Counts that are shown as black and as white.
  low: 0,
  high: 255,
  // Device pixels a pixel of the frame takes, and the frame's point in the middle of the canvas.
  zoom: 1,
  middle: [0, 0],
  tool: "move",
  subsets: [],
  selected: -1,
  undo: [],
  proposal: null,
  tracks: [],
  // The name of the track that is reviewed.
  marked: null,
  // What is being drawn: two points of the frame.
  drawing: null,
  // Corners of the polygon that is being drawn.
  corners: [],
  // Both ends of a known length.
  ruler: null,
};

/** The address of a part of the server, for the recording in view. */
function address(path, parameters = {}) {
  const query = new URLSearchParams({ recording: state.index, ...parameters });
  return `/api/${path}?${query}`;
}

/** Asks the server; what it refuses becomes an error in its own words. */
async function ask(url, options = {}) {
  const answer = await fetch(url, { ...options, headers: { "X-Token": token, ...options.headers } });
  if (answer.ok) return answer;
  let text = `${answer.status} ${answer.statusText}`;
  try {
    const { path, expected, found, hint } = await answer.json();
    text = `${path ? path + ": " : ""}expected ${expected}, found ${found}${hint ? ` (${hint})` : ""}`;
  } catch { /* the status has to do */ }
  const error = new Error(text);
  error.status = answer.status;
  throw error;
}

const askJson = async (url, options) => (await ask(url, options)).json();

function say(text, isBad = false) {
  byId("status").textContent = text;
  byId("status").classList.toggle("bad", isBad);
}

const complain = (error) => { if (error.name !== "AbortError") say(error.message, true); };
const clamp = (value, least, most) => Math.min(Math.max(value, least), most);
const fixed = (value, digits) => (value === null || value === undefined ? "" : value.toFixed(digits));

/** Waits until nothing more comes, then does it once. */
function later(action, milliseconds) {
  let timer = 0;
  return (...values) => {
    clearTimeout(timer);
    timer = setTimeout(() => action(...values), milliseconds);
  };
}
