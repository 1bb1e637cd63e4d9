// The wave beside its frames: the map's cursor moves the frame, and the frame the cursor.

async function startWave() {
  showWave(await askJson("/api/wave"), (timeS) => {
    if (!state.info) return;
    const { first_time_s: first, last_time_s: last, n_frames: n } = state.info;
    toFrame((last > first ? (timeS - first) / (last - first) : 0) * (n - 1));
  });
}

/** Moves the cursor to the frame that is shown. */
function followFrame() {
  if (!wave.data || state.timeS === null) return;
  const times = wave.data.times_s;
  const step = times.length > 1 ? (times[times.length - 1] - times[0]) / (times.length - 1) : 1;
  toInstant((state.timeS - times[0]) / step, wave.row);
}
