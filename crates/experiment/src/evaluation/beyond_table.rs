//! Overlaps beyond the points between which a contact's table states its force.

use chainwave_analysis::StrainMap;
use chainwave_measurement::Estimate;
use chainwave_mechanics::{Chain, Law};

use crate::finding::Finding;
use crate::wording::named;

/// Standard deviations by which an overlap is beyond a table: noise takes one sample of a million so far.
const BEYOND_SIGMAS: f64 = 5.0;

/// Says in which gaps strains leave the table of the contact, whose last tangents stand for its force and energy there.
pub(crate) fn beyond_table(chain: &Chain, strain: &StrainMap) -> Option<Finding> {
    let mut gaps: Vec<String> = Vec::new();
    let (mut largest_m, mut nearest_m) = (0.0_f64, 0.0);
    for gap in 1..=strain.n_gaps() {
        let contact = chain.contact.of_gap(gap - 1);
        let Law::Table(table) = &contact.law else { continue };
        let [first_m, last_m] = table.range_m();
        let pitch_m = strain.spacing.of_gap_m(gap);
        let beyond = |strain: &Estimate| {
            let (overlap_m, reach_m) = (-strain.value * pitch_m, BEYOND_SIGMAS * strain.sigma * pitch_m);
            let by = |end_m: f64, past_m: f64| (past_m > reach_m).then_some((past_m, overlap_m, end_m));
            by(last_m, overlap_m - last_m).or(by(first_m, first_m - overlap_m))
        };
        let samples = strain.strain.row(gap - 1);
        let farthest = samples.iter().flatten().filter_map(beyond).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, overlap_m, end_m)) = farthest {
            gaps.push(format!("gap {gap}"));
            if overlap_m.abs() > largest_m.abs() {
                (largest_m, nearest_m) = (overlap_m, end_m);
            }
        }
    }
    (!gaps.is_empty()).then(|| Finding {
        code: "beyond_table",
        subject: "the contact".into(),
        text: format!(
            "{} leave{} the table of the contact: an overlap of {:.3} mm, where its last point is at {:.3} mm; forces and energies beyond are those of \
             the tangent there (hint: points up to that overlap, or a law)",
            named(&gaps.iter().map(String::as_str).collect::<Vec<_>>()),
            if gaps.len() == 1 { "s" } else { "" },
            1e3 * largest_m,
            1e3 * nearest_m
        ),
    })
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{Contact, Contacts, Drive, FarEnd, Striker, TableLaw, Tension};
    use ndarray::Array2;

    use super::*;

    fn chain(last_m: f64) -> Chain {
        let law = Law::Table(TableLaw::new(&[-1e-3, 0.0, last_m], &[-1.0, 0.0, 1e3 * last_m]).unwrap());
        Chain {
            mass_kg: vec![1e-3; 3],
            damping_kg_per_s: vec![0.0; 3],
            ground_stiffness_n_per_m: vec![0.0; 3],
            ground_law: None,
            contact: Contacts::Same(Contact {
                law,
                tension: Tension::Tangent { limit: -0.5 },
                damping_kg_per_s: 0.0,
            }),
            far_end: FarEnd::Free,
            drive: Drive::Striker(Striker {
                mass_kg: 1e-3,
                velocity_m_per_s: 1.0,
                damping_kg_per_s: 0.0,
                ground_damping_kg_per_s: 0.0,
            }),
        }
    }

    #[test]
    fn overlaps_beyond_the_last_point_are_named_with_their_gap() {
        // 1.5 mm in gap 1 and 0.5 mm in gap 2, of bodies 10 mm apart
        let strain = Array2::from_shape_fn((2, 3), |(gap, k)| {
            let overlap_m = if gap == 0 { 1.5e-3 } else { 0.5e-3 };
            Some(Estimate::new(if k == 1 { -overlap_m / 0.01 } else { 0.0 }, 1e-3))
        });
        let map = StrainMap { times_s: vec![0.0, 1e-3, 2e-3], spacing: 0.01.into(), strain };
        assert_eq!(beyond_table(&chain(2e-3), &map), None);
        let found = beyond_table(&chain(1e-3), &map).unwrap();
        assert!(found.text.starts_with("gap 1 leaves the table"), "{}", found.text);
        assert!(found.text.contains("1.500 mm") && found.text.contains("1.000 mm"), "{}", found.text);
        // Half a millimetre beyond is fewer than five sigma of strains so uncertain.
        let uncertain = map.strain.mapv(|one| one.map(|one| Estimate::new(one.value, 0.02)));
        assert_eq!(beyond_table(&chain(1e-3), &StrainMap { strain: uncertain, ..map }), None);
    }
}
