// Review: readings to look at, the most doubtful first; what is excluded or seeded goes to the server's file of corrections.

const review = { queue: [], at: -1, corrections: [], version: 0, path: "" };
const PARTS = ["reference", "found", "residual"];

async function startReview() {
  const found = await askJson("/api/review");
  Object.assign(review, found);
  byId("review-box").hidden = false;
  byId("review-path").textContent = `Corrections go to ${found.path}; run reads them from beside its experiment.`;
  listQueue();
  listCorrections();
}

const queuedName = ({ recording, name, frame }) => `${byId("recording").options[recording].text}, ${name}, frame ${frame}`;

/** The correction that a reading falls under, if any. */
function correctionOf({ recording, name, frame }) {
  const isOf = (one) => one.recording === recording && (one.name === null || one.name === name)
    && one.first_frame <= frame && (one.last_frame === null || frame <= one.last_frame);
  return review.corrections.find(isOf);
}

function rowOf(cells, onClick) {
  const row = document.createElement("tr");
  for (const content of cells) {
    const cell = document.createElement("td");
    cell.append(content);
    row.append(cell);
  }
  if (onClick) row.addEventListener("click", onClick);
  return row;
}

function listQueue() {
  const rows = review.queue.map((one, i) => {
    const done = correctionOf(one);
    const row = rowOf([queuedName(one), one.doubt.toFixed(1), done ? done.remedy : one.reason], () => toDoubtful(i).catch(complain));
    row.setAttribute("aria-selected", i === review.at);
    return row;
  });
  byId("queue").replaceChildren(...rows);
}

function listCorrections() {
  const rows = review.corrections.map((one, i) => {
    const gone = document.createElement("button");
    gone.textContent = "×";
    gone.setAttribute("aria-label", `take back correction ${i + 1}`);
    gone.addEventListener("click", () => correct(review.corrections.filter((_, k) => k !== i)));
    const frames = `${one.first_frame} to ${one.last_frame === null ? "end" : one.last_frame}`;
    return rowOf([byId("recording").options[one.recording].text, one.name === null ? "all" : one.name, frames, one.remedy, gone]);
  });
  byId("corrections").replaceChildren(...rows);
}

/** Goes to a reading of the queue: its recording and frame, with the subset beside its reference and what differs. */
async function toDoubtful(index) {
  if (!review.queue.length) return;
  review.at = clamp(index, 0, review.queue.length - 1);
  const one = review.queue[review.at];
  if (one.recording !== state.index || !state.info) {
    byId("recording").value = one.recording;
    await toRecording(one.recording);
  }
  await toFrame(one.frame);
  const track = state.tracks.find(({ name }) => name === one.name);
  if (track) {
    state.marked = one.name;
    state.middle = (track.place_px || track.rest_px || state.middle).slice();
    draw();
  }
  byId("first-frame").value = one.stretch[0];
  byId("last-frame").value = one.stretch[1];
  byId("doubt").textContent = `${review.at + 1} of ${review.queue.length}: ${queuedName(one)}; ${one.reason}`;
  listQueue();
  byId("queue").children[review.at].scrollIntoView({ block: "nearest" });
  await Promise.all(PARTS.map((part) => showPart(one, part)));
}

async function showPart(one, part) {
  const answer = await ask(address(`subset/${one.frame}`, { name: one.name, part }));
  const bitmap = await createImageBitmap(await answer.blob());
  if (review.queue[review.at] !== one) return;
  const canvas = byId(`part-${part}`);
  canvas.width = bitmap.width;
  canvas.height = bitmap.height;
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
}

/** The frames that a correction is about, as they stand in the boxes. */
function statedFrames() {
  const [first, last] = ["first-frame", "last-frame"].map((id) => Math.round(Number(byId(id).value)));
  return { first_frame: first, last_frame: last };
}

function correctReading(remedy, place) {
  const one = review.queue[review.at];
  if (!one || one.recording !== state.index) {
    say("go to a reading of the queue first (r)", true);
    return;
  }
  const { recording, name } = one;
  const frames = remedy === "seed" ? { ...statedFrames(), first_frame: state.frame } : statedFrames();
  const tenth = place && place.map((value) => Math.round(10 * value) / 10);
  const added = { recording, name, ...frames, remedy, place_px: tenth || null, note: byId("why").value.trim() };
  if (added.last_frame < added.first_frame) added.last_frame = state.info.n_frames - 1;
  correct([...review.corrections, added]);
}

async function correct(corrections) {
  const box = byId("review-said");
  try {
    const body = JSON.stringify({ version: review.version, corrections });
    const { version, path } = await askJson("/api/corrections", { method: "PUT", body });
    Object.assign(review, { version, corrections });
    box.textContent = `wrote ${path}: ${corrections.length} correction(s). They count with the next run.`;
    box.classList.remove("bad");
    listQueue();
    listCorrections();
  } catch (error) {
    box.textContent = error.message;
    box.classList.add("bad");
  }
}

const nextDoubtful = (step) => toDoubtful(review.at + step).catch(complain);

function armSeed() {
  if (review.at < 0) {
    say("go to a reading of the queue first (r)", true);
    return;
  }
  state.tool = "seed";
  say(`click the centre of subset ${review.queue[review.at].name} in this frame; it is followed anew from there`);
}

function connectReview() {
  byId("next-doubtful").addEventListener("click", () => nextDoubtful(1));
  byId("exclude").addEventListener("click", () => correctReading("exclude"));
  byId("seed").addEventListener("click", armSeed);
}
