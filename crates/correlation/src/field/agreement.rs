//! Shape functions of neighbours held against each other.
//!
//! A point alone asks for no more than its own match cannot explain: where a wave crosses zero, or where its texture is weak, that may be
//! less than all around it ask for. What a subset cannot reject is not therefore so, and a shape function of too low an order leaves an error
//! that is no noise. So a point whose neighbours need a higher order, most of them, is matched again with it.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

use crate::field::pair::{ImagePair, Settled};
use crate::{Shape, ShapeChoice, Workspace};

/// Found neighbours, of eight, from which on they are a majority of something.
const LEAST_NEIGHBOURS: usize = 3;

/// Matches again the points that most neighbours exceed in the order of their shape function.
pub(crate) fn agree_on_shapes(
    pair: &ImagePair<'_>,
    places: &[[f64; 2]],
    n_columns: usize,
    n_threads: NonZero<usize>,
    settled: &mut [Option<Settled>],
) {
    if pair.choice != ShapeChoice::ByEvidence {
        return;
    }
    let shapes: Vec<Option<Shape>> = settled
        .iter()
        .map(|one| one.as_ref().and_then(|(found, shape)| found.is_ok().then_some(*shape)))
        .collect();
    let exceeded: Vec<(usize, Shape)> = (0..shapes.len())
        .filter_map(|point| {
            let of_most = shape_of_most(&shapes, n_columns, point)?;
            (order(of_most) > order(shapes[point]?)).then_some((point, of_most))
        })
        .collect();
    let again = map_in_parallel(exceeded.len(), n_threads, |i| {
        let (point, shape) = exceeded[i];
        let Some((Ok(found), _)) = &settled[point] else { return None };
        pair.settle_with(places[point], shape, found.warp(), &mut Workspace::default())
    });
    for ((point, shape), again) in exceeded.into_iter().zip(again) {
        if let Some(found) = again {
            settled[point] = Some((Ok(found), shape));
        }
    }
}

/// The shape function that more than half of a point's eight neighbours need at least.
fn shape_of_most(shapes: &[Option<Shape>], n_columns: usize, point: usize) -> Option<Shape> {
    let (column, row, n_rows) = (point % n_columns, point / n_columns, shapes.len() / n_columns);
    let near = |place: usize, n: usize| place.saturating_sub(1)..(place + 2).min(n);
    let others = near(row, n_rows)
        .flat_map(|row| near(column, n_columns).map(move |column| row * n_columns + column))
        .filter(|&other| other != point);
    let mut found: Vec<Shape> = others.filter_map(|other| shapes[other]).collect();
    found.sort_by_key(|shape| std::cmp::Reverse(order(*shape)));
    (found.len() >= LEAST_NEIGHBOURS).then(|| found[found.len() / 2])
}

/// Place among the shape functions, the simplest first.
fn order(shape: Shape) -> usize {
    shape.n_parameters()
}
