//! One recording of an experiment.

use chainwave_measurement::Estimate;

/// One recording of an experiment: a row of `trials.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// File name of the recording, relative to the table's folder.
    pub recording: String,
    /// Number of the camera view.
    pub view: u32,
    /// Number of the trial in that view.
    pub trial: u32,
    /// Position of the camera's stage along the chain.
    pub stage_m: f64,
    /// Magnification of the view in the middle of its pictures, where it is not that of the others.
    pub scale_px_per_m: Option<f64>,
    /// Nominal striker velocity where an experiment has several, with its scatter from trial to trial.
    pub striker_velocity_m_per_s: Option<Estimate>,
}

impl Trial {
    /// Whether it says that it is the same trial of the same view at the same nominal striker velocity.
    pub(super) fn is_same_shot(&self, other: &Self) -> bool {
        let nominal = |one: &Self| one.striker_velocity_m_per_s.map(|velocity| velocity.value);
        (self.view, self.trial) == (other.view, other.trial) && nominal(self) == nominal(other)
    }

    /// Whether the camera saw the same place in it: the same view, with the stage where it stood.
    pub(crate) fn is_of_one_place_with(&self, other: &Self) -> bool {
        self.view == other.view && self.stage_m.total_cmp(&other.stage_m).is_eq()
    }

    /// Recordings that were made with the stage in one place, place by place.
    pub(crate) fn by_place<'a>(trials: impl IntoIterator<Item = &'a Self>) -> Vec<Vec<Self>> {
        let mut places: Vec<Vec<Self>> = Vec::new();
        for trial in trials {
            match places.iter_mut().find(|place| place[0].is_of_one_place_with(trial)) {
                Some(place) => place.push(trial.clone()),
                None => places.push(vec![trial.clone()]),
            }
        }
        places
    }

    /// Whether it is among the first so many of its view, by their numbers.
    pub(crate) fn is_among_first<'a>(&self, n: usize, all: impl Iterator<Item = &'a Self>) -> bool {
        all.filter(|other| other.view == self.view && other.trial < self.trial).count() < n
    }

    /// The largest number of trials of a view.
    pub(crate) fn most_of_a_view<'a>(all: impl IntoIterator<Item = &'a Self>) -> usize {
        let views: Vec<u32> = all.into_iter().map(|one| one.view).collect();
        let of_view = |view: &u32| views.iter().filter(|other| *other == view).count();
        views.iter().map(of_view).max().unwrap_or(0)
    }
}
