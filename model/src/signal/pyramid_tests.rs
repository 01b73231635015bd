use super::*;
use crate::random::SplitMix;

/// Numbers with many ties, and gaps alone and in stretches.
fn values(random: &mut SplitMix, count: usize, gaps: bool) -> Vec<f32> {
    let mut gap_left = 0;
    (0..count)
        .map(|_| {
            if gaps && gap_left == 0 && random.below(40) == 0 {
                gap_left = 1 + random.below(90);
            }
            gap_left = gap_left.saturating_sub(1);
            match gap_left {
                0 => (random.below(50) as f32) - 20.0,
                one if one % 3 == 0 => f32::INFINITY,
                _ => f32::NAN,
            }
        })
        .collect()
}

/// The same, added in pieces of any length.
fn pyramid(random: &mut SplitMix, values: &[f32]) -> Pyramid {
    let mut pyramid = Pyramid::default();
    let mut rest = values;
    while !rest.is_empty() {
        let (piece, later) = rest.split_at(1 + random.below(rest.len().min(700)));
        pyramid.extend(piece.iter().copied());
        rest = later;
    }
    pyramid
}

fn columns(
    pyramid: &Pyramid,
    from: usize,
    to: usize,
    column: usize,
) -> Vec<(usize, Option<ColumnStatistics>)> {
    let mut found = Vec::new();
    pyramid.columns(from, to, column, |at, one| found.push((at, one)));
    found
}

#[test]
fn extremes_of_any_range_are_those_of_its_samples() {
    let mut random = SplitMix::seeded(12);
    let raw = values(&mut random, 20_011, true);
    let pyramid = pyramid(&mut random, &raw);
    for _ in 0..2000 {
        let from = random.below(raw.len());
        let to = from + random.below(raw.len() - from + 3);
        let own = raw[from..to.min(raw.len())].iter().filter(|one| one.is_finite());
        let low = own.clone().copied().reduce(f32::min);
        let high = own.copied().reduce(f32::max);
        let found = pyramid.extremes(from, to);
        assert_eq!(found, low.zip(high).map(|(low, high)| [low, high]), "{from}..{to}");
    }
}

#[test]
fn nothing_one_sample_and_ranges_beyond_the_end_have_columns() {
    let mut pyramid = Pyramid::default();
    assert!(columns(&pyramid, 0, 10, 4).is_empty());
    assert_eq!(pyramid.extremes(0, 10), None);
    pyramid.extend([3.0]);
    let alone = ColumnStatistics { low: 3.0, high: 3.0, mean: 3.0, has_gap: false };
    for column in [1, 2, 16, 4096] {
        assert_eq!(columns(&pyramid, 0, 1, column), [(0, Some(alone))]);
    }
    assert!(columns(&pyramid, 5, 9, 1).is_empty());
    let mut nothing = Pyramid::default();
    nothing.extend([f32::NAN; 100]);
    assert_eq!(columns(&nothing, 0, 100, 64), [(0, None), (64, None)]);
    assert_eq!(nothing.extremes(0, 100), None);
}

#[test]
fn there_are_at_most_two_columns_a_pixel_and_the_memory_is_as_stated() {
    let mut random = SplitMix::seeded(13);
    let raw = values(&mut random, 1 << 20, false);
    let pyramid = pyramid(&mut random, &raw);
    let per_sample = pyramid.bytes() as f64 / raw.len() as f64;
    assert!((5.3..5.4).contains(&per_sample), "{per_sample}");
    for (samples, pixels) in [(1000, 800.0), (1601, 800.0), (40_000, 333.0), (1 << 20, 1600.0)] {
        let count = columns(&pyramid, 0, samples, column_for(samples, pixels)).len();
        assert!(count as f64 <= 2.0 * pixels + 2.0, "{count}");
        // And not many fewer than there is room for.
        assert!(count as f64 >= 0.45 * pixels.min(samples as f64), "{count}");
    }
}

/// The mean, lowest and highest of every column are those of its samples, over any range and beside gaps.
#[test]
fn columns_have_what_their_samples_have() {
    let mut random = SplitMix::seeded(13);
    for round in 0..300 {
        let count = 1 + random.below(if round % 10 == 0 { 40_000 } else { 900 });
        let raw = values(&mut random, count, round % 2 == 1);
        let pyramid = pyramid(&mut random, &raw);
        assert_eq!(pyramid.len(), count);
        let column = 1 << random.below(14);
        let from = random.below(count);
        let to = from + 1 + random.below(count - from);
        let mut next = from / column * column;
        for (at, found) in columns(&pyramid, from, to, column) {
            assert_eq!(at, next);
            next += column;
            let own = &raw[at..(at + column).min(count)];
            let known = || own.iter().copied().filter(|one| one.is_finite());
            let Some(found) = found else {
                assert_eq!(known().count(), 0);
                continue;
            };
            assert_eq!(Some(found.low), known().reduce(f32::min));
            assert_eq!(Some(found.high), known().reduce(f32::max));
            assert_eq!(found.has_gap, known().count() < own.len());
            let mean = known().map(f64::from).sum::<f64>() / known().count() as f64;
            // An f32 has 24 bits, and a column at most seven levels that each round once; values are below 32.
            let rounding = 7.0 * 32.0 / f64::from(1 << 24);
            assert!((f64::from(found.mean) - mean).abs() < rounding, "{} of {mean}", found.mean);
        }
        assert!(next >= to);
    }
}
