// An experiment set up from what was picked: bodies by number, the rest, a ruler, and the numbers that no picture tells.

let setUp = null;

function startSetUp(asked) {
  setUp = asked;
  byId("set-up-box").hidden = false;
  byId("ruler-tool").hidden = false;
  byId("set-up-said").textContent = `Goes to ${asked.path}.`;
  byId("questions").replaceChildren(...asked.questions.map(({ key, label: text, hint }) => {
    const line = document.createElement("label");
    const input = document.createElement("input");
    input.inputMode = "decimal";
    input.dataset.question = key;
    input.title = hint;
    line.append(text, input);
    return line;
  }));
  byId("renumber").addEventListener("click", renumber);
  byId("rest-here").addEventListener("click", restHere);
  byId("set-up").addEventListener("click", writeExperiment);
}

/** What belongs to one recording's picture. */
function forgetSetUp() {
  if (!setUp) return;
  state.ruler = null;
  sayRuler();
  const rest = setUp.rest_until_s;
  if (rest !== null && !byId("rest-until").value) byId("rest-until").value = (1e3 * rest).toFixed(4);
}

/** Names subsets by numbers along the line that they lie on. */
function renumber() {
  if (!state.subsets.length) { say("no subset to number", true); return; }
  remember();
  const spread = (axis) => {
    const values = state.subsets.map((subset) => subset[axis]);
    return Math.max(...values) - Math.min(...values);
  };
  const along = spread("x_px") >= spread("y_px") ? "x_px" : "y_px";
  const sense = Number(byId("away").value);
  const first = Math.max(1, Math.round(Number(byId("first-number").value)) || 1);
  state.subsets.sort((a, b) => sense * (a[along] - b[along]));
  state.subsets.forEach((subset, i) => { subset.name = String(first + i); });
  changed();
}

function restHere() {
  if (state.timeS === null) say("this frame has no time", true);
  else byId("rest-until").value = (1e3 * state.timeS).toFixed(4);
}

function layRuler(from, to) {
  if (Math.hypot(to[0] - from[0], to[1] - from[1]) < 5) return;
  state.ruler = [from, to];
  sayRuler();
}

function sayRuler() {
  const { ruler } = state;
  byId("ruler-said").textContent = ruler
    ? `A ruler of ${Math.hypot(ruler[1][0] - ruler[0][0], ruler[1][1] - ruler[0][1]).toFixed(1)} px, from the striker's side on.`
    : "The scale comes from the pitch, or from a ruler that is laid in the picture, from the striker's side on.";
}

/** A number that was written by hand, with a decimal point or comma; null where nothing was. */
function written(text) {
  if (!text.trim()) return null;
  const number = Number(text.trim().replace(",", "."));
  if (!Number.isFinite(number)) throw new Error(`expected a number, found ${JSON.stringify(text)}`);
  return number;
}

async function writeExperiment() {
  const box = byId("set-up-said");
  try {
    const rest = written(byId("rest-until").value);
    const answers = {};
    for (const input of document.querySelectorAll("[data-question]")) answers[input.dataset.question] = input.value;
    const sent = { points: state.subsets.map(plain), ruler_px: state.ruler, rest_until_s: rest === null ? null : 1e-3 * rest, answers };
    const overwrite = byId("set-up-overwrite").checked;
    const { said } = await askJson(address("experiment", { overwrite }), { method: "PUT", body: JSON.stringify(sent) });
    box.textContent = said;
    box.classList.remove("bad");
    byId("set-up-overwrite").checked = false;
  } catch (error) {
    box.textContent = error.message;
    box.classList.add("bad");
  }
}
