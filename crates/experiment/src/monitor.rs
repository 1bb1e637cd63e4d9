//! How long work reports its progress to the caller, and hears that it shall stop.

/// What takes long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Following bodies through recordings; its steps are frames.
    Tracking,
    /// Stitching, measuring and fitting what was tracked; its steps take unequal times.
    Evaluating,
    /// Rendering synthetic recordings; its steps are recordings.
    Filming,
    /// Rehearsing what an experiment will tell; its steps are rehearsals.
    Planning,
}

/// News of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Progress {
    /// So many more steps are to be done.
    Planned(Stage, u64),
    /// So many more steps are done.
    Done(Stage, u64),
    /// The stage has ended.
    Ended(Stage),
}

/// The caller's side of long work. Both functions are called from several threads.
#[derive(Clone, Copy)]
pub struct Monitor<'a> {
    /// Hears of progress.
    pub on_progress: &'a (dyn Fn(Progress) + Sync),
    /// Says whether work shall stop. It is asked between recordings: the one in hand is finished and kept.
    pub is_cancelled: &'a (dyn Fn() -> bool + Sync),
}

impl Monitor<'_> {
    /// Hears nothing and never stops.
    pub const SILENT: Monitor<'static> = Monitor { on_progress: &|_| (), is_cancelled: &|| false };

    pub(crate) fn planned(&self, stage: Stage, steps: u64) {
        (self.on_progress)(Progress::Planned(stage, steps));
    }

    pub(crate) fn done(&self, stage: Stage, steps: u64) {
        (self.on_progress)(Progress::Done(stage, steps));
    }

    pub(crate) fn ended(&self, stage: Stage) {
        (self.on_progress)(Progress::Ended(stage));
    }
}
