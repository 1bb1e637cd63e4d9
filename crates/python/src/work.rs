//! Long work in a thread of its own: the caller's thread tells of progress, and listens for Ctrl-C.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use chainwave_experiment::{Monitor, Progress, Stage};
use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};
use pyo3::prelude::*;

use crate::failure::Failure;

/// How often Ctrl-C is looked for.
const POLL: Duration = Duration::from_millis(20);
/// Room for the deepest call, as a program's first thread has it.
const STACK_BYTES: usize = 8 << 20;

/// What work and its caller tell each other.
#[derive(Debug, Default)]
pub(crate) struct Link {
    is_cancelled: AtomicBool,
    stage: AtomicU8,
    planned: AtomicU64,
    done: AtomicU64,
}

impl Link {
    /// Whether the work shall stop.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    /// So many more steps are done, of work that has no stages.
    pub(crate) fn advance(&self, n: u64) {
        self.done.fetch_add(n, Ordering::Relaxed);
    }

    fn hear(&self, news: Progress) {
        match news {
            Progress::Planned(stage, steps) => {
                self.stage.store(u8::from(stage == Stage::Filming), Ordering::Relaxed);
                self.planned.fetch_add(steps, Ordering::Relaxed);
            }
            Progress::Done(_, steps) => self.advance(steps),
            _ => {}
        }
    }

    /// Stage, steps done, steps planned.
    fn news(&self) -> (&'static str, u64, u64) {
        let stage = if self.stage.load(Ordering::Relaxed) == 0 { "tracking" } else { "filming" };
        (stage, self.done.load(Ordering::Relaxed), self.planned.load(Ordering::Relaxed))
    }
}

/// Does work without the interpreter's lock. `progress`, where it is not None, is called in this thread with the stage, the steps that
/// are done and those that are planned; what it raises, and Ctrl-C, ends the call at once, and the work as soon as it looks up.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Monitor<'_>, &Arc<Link>) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let link = Arc::new(Link::default());
    let (sender, mut receiver) = mpsc::channel();
    let of_work = Arc::clone(&link);
    let carry_out = move || {
        let (show, stop) = (|news| of_work.hear(news), || of_work.is_cancelled());
        let monitor = Monitor { on_progress: &show, is_cancelled: &stop };
        // Nobody listens any more where the caller was interrupted.
        let _unheard = sender.send(work(&monitor, &of_work));
    };
    let spawned = thread::Builder::new().name("chainwave".into()).stack_size(STACK_BYTES).spawn(carry_out);
    spawned.map_err(|error| Failure::Argument(format!("a thread for the work: {error}")))?;
    let mut last = link.news();
    loop {
        let (back, heard) = py.detach(move || wait(receiver));
        receiver = back;
        if let Some(result) = heard {
            tell(progress, &link, &mut last)?;
            return result?.map_err(PyErr::from);
        }
        let told = tell(progress, &link, &mut last).and_then(|()| py.check_signals());
        if let Err(interruption) = told {
            link.is_cancelled.store(true, Ordering::Relaxed);
            return Err(interruption);
        }
    }
}

/// What work ended with; a failure of its own where it broke off.
type Ended<T> = Result<Result<T, Failure>, Failure>;

/// Waits a little for the end of work; the receiver goes to and fro, as no two threads may hold it.
fn wait<T>(receiver: Receiver<Result<T, Failure>>) -> (Receiver<Result<T, Failure>>, Option<Ended<T>>) {
    let heard = match receiver.recv_timeout(POLL) {
        Ok(result) => Some(Ok(result)),
        Err(RecvTimeoutError::Timeout) => None,
        Err(RecvTimeoutError::Disconnected) => Some(Err(Failure::Argument(
            "the work broke off, by a fault of the program that standard error tells of: please report it"
                .into(),
        ))),
    };
    (receiver, heard)
}

/// Calls `progress` where there is news.
fn tell(
    progress: Option<&Bound<'_, PyAny>>,
    link: &Link,
    last: &mut (&'static str, u64, u64),
) -> PyResult<()> {
    let news = link.news();
    if news != *last {
        *last = news;
        if let Some(progress) = progress {
            progress.call1(news)?;
        }
    }
    Ok(())
}

/// A recording that cannot be read any more once its reader shall stop, which ends the reader soon.
pub(crate) struct Stoppable {
    pub(crate) recording: Arc<dyn Recording>,
    pub(crate) link: Arc<Link>,
}

impl Recording for Stoppable {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        self.recording.info()
    }

    fn is_sequential(&self) -> bool {
        self.recording.is_sequential()
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        self.recording.will_read(frames, regions);
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        if self.link.is_cancelled() {
            let (path, reason) = (self.path().to_owned(), "the caller asked to stop".into());
            return Err(ReadError::Unreadable { path, frame, reason });
        }
        self.recording.read_region(frame, region, pixels)
    }
}
