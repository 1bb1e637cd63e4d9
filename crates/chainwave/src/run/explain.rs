//! What a run kept of earlier ones, and what it made anew.

use chainwave_experiment::{Origin, Tracked};

/// Notes on kept tracks that were torn, whether they are asked for or not.
pub(super) fn notes(tracked: &Tracked) -> impl Iterator<Item = String> + '_ {
    tracked.recordings.iter().filter_map(|one| match &one.origin {
        Origin::Torn(_) => Some(format!("note: {}", of_recording(&one.trial.recording, &one.origin))),
        _ => None,
    })
}

/// Stage by stage, what was kept, what was made anew, and why.
pub(super) fn stages(tracked: &Tracked) -> Vec<String> {
    let recordings = &tracked.recordings;
    let n_kept = recordings.iter().filter(|one| one.origin == Origin::Kept).count();
    let mut lines = vec![
        "stage positions: matched anew, as always (they place subsets, and so decide which tracks hold)"
            .to_owned(),
        format!("tracks: {n_kept} of {} recordings kept", recordings.len()),
    ];
    lines.extend(
        recordings.iter().map(|one| format!("  {}", of_recording(&one.trial.recording, &one.origin))),
    );
    lines.push("stitching, analysis, fits and decisions: made anew from the tracks, as always".to_owned());
    lines.push("tables, figures and report: written anew".to_owned());
    lines
}

fn of_recording(name: &str, origin: &Origin) -> String {
    match origin {
        Origin::Kept => format!("{name}: kept"),
        Origin::New(differing) if differing.is_empty() => {
            format!("{name}: tracked, as nothing was kept of it")
        }
        Origin::New(differing) => {
            format!("{name}: tracked anew, as what was kept differs in {}", differing.join(", "))
        }
        Origin::Torn(reason) => format!("{name}: tracked anew, as what was kept is torn ({reason})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_origin_has_its_sentence() {
        let told = |origin: &Origin| of_recording("a.cine", origin);
        assert_eq!(told(&Origin::Kept), "a.cine: kept");
        assert!(told(&Origin::New(Vec::new())).contains("nothing was kept"));
        assert!(
            told(&Origin::New(vec!["method", "subsets"]))
                .contains("what was kept differs in method, subsets")
        );
        assert!(told(&Origin::Torn("cut".into())).contains("torn (cut)"));
    }
}
