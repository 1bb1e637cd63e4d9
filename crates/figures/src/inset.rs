//! A plot inside another one, at a place where it covers nothing that was drawn.

use crate::colour::WHITE;
use crate::drawing::Drawing;
use crate::geometry::{PageRect, Spot};
use crate::plot::{INSET, LABEL_GAP_MM, MARKER_MM, NUMBER_GAP_MM, Plot, n_ticks_up, widest};
use crate::scale::Scale;
use crate::series::{Origin, Series};

impl Plot {
    /// A plot inside another: a white ground of the given width and height, or somewhat less, with its numbers and labels on it,
    /// where it covers none of `lines`, near the upper right corner if there is a choice; none where no place is free.
    pub(crate) fn inset(
        &self,
        drawing: &mut Drawing,
        (x, y): (Scale, Scale),
        size: (f64, f64),
        lines: &[Vec<Spot>],
    ) -> Option<Self> {
        let ground = self.free_place(size, lines)?;
        drawing.fill(ground, WHITE);
        let em = drawing.number_mm();
        let numbers = widest(drawing, &y.ticks(n_ticks_up(ground.height())), INSET * em);
        let frame = PageRect {
            left: ground.left + numbers + NUMBER_GAP_MM + LABEL_GAP_MM + 0.8 * em,
            top: ground.top + 0.5 * em,
            right: ground.right - 0.9,
            bottom: ground.bottom - NUMBER_GAP_MM - 2.2 * em,
        };
        Some(Self { frame, x, y, compact: true })
    }

    /// Whether an inset of this size has a free place.
    pub(crate) fn has_place(&self, size: (f64, f64), lines: &[Vec<Spot>]) -> bool {
        self.free_place(size, lines).is_some()
    }

    /// A rectangle inside the frame that none of `lines` runs through.
    fn free_place(&self, (width, height): (f64, f64), lines: &[Vec<Spot>]) -> Option<PageRect> {
        const EDGE_MM: f64 = 1.6;
        const N_PLACES: i32 = 24;
        let inside = self.frame.grown(-EDGE_MM);
        // A line of one spot is a marker.
        let is_free = |place: &PageRect| {
            let near = place.grown(MARKER_MM);
            lines.iter().all(|line| match line[..] {
                [spot] => !near.holds(spot),
                _ => near.clip(line).is_empty(),
            })
        };
        [1.0, 0.9, 0.8].into_iter().find_map(|scale| {
            let (width, height) = (scale * width, scale * height);
            let mut steps: Vec<(i32, i32)> =
                (0..=N_PLACES).flat_map(|i| (0..=N_PLACES).map(move |k| (i, k))).collect();
            steps.sort_by_key(|(i, k)| i * i + k * k);
            let place = |(i, k): (i32, i32)| {
                let share = |step: i32| f64::from(step) / f64::from(N_PLACES);
                let left = inside.right - width - share(i) * (inside.width() - width);
                let top = inside.top + share(k) * (inside.height() - height);
                PageRect::new(left, top, width, height)
            };
            steps.into_iter().map(place).find(is_free)
        })
    }

    /// The spots of a curve, and of each point by itself where it has markers, for [`Plot::inset`].
    pub(crate) fn obstacles(&self, series: &[Series]) -> Vec<Vec<Spot>> {
        let of_series = |series: &Series| {
            let places = series.points.iter().map(|point| (point.x.value, point.y.value));
            if series.origin == Origin::Model {
                self.pieces(&places.collect::<Vec<_>>())
            } else {
                places.filter_map(|(x, y)| self.spot(x, y)).map(|spot| vec![spot]).collect()
            }
        };
        series.iter().flat_map(of_series).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scale::Extent;

    fn plot() -> Plot {
        let unit = Scale::linear(Some(Extent { low: 0.0, high: 1.0 }));
        Plot::new(PageRect::new(10.0, 5.0, 70.0, 50.0), unit, unit)
    }

    #[test]
    fn an_inset_covers_no_line_and_no_marker() {
        let line = |f: &dyn Fn(f64) -> f64| -> Vec<Spot> {
            (0..=40).map(|i| f64::from(i) / 40.0).filter_map(|x| plot().spot(x, f(x))).collect()
        };
        let marker = plot().spot(0.9, 0.9).unwrap();
        for lines in [
            vec![line(&|x| 1.0 - x)],
            vec![line(&|x| x)],
            vec![line(&|x| 0.2 + 0.1 * x), vec![marker]],
            vec![line(&|_| 0.97), line(&|x| 1.0 - 0.9 * x.sqrt())],
        ] {
            let place = plot().free_place((30.0, 18.0), &lines).unwrap();
            assert!(place.corners().iter().all(|corner| plot().frame.holds(*corner)));
            for spots in &lines {
                assert!(spots.iter().all(|spot| !place.holds(*spot)), "{place:?} {spots:?}");
            }
        }
        // A wave from top to bottom leaves no place of half the height.
        assert!(plot().free_place((30.0, 40.0), &[line(&|x| 0.5 + 0.5 * (40.0 * x).sin())]).is_none());
    }
}
