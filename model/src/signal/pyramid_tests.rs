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

fn drawn(pyramid: &Pyramid, from: usize, to: usize, column: usize) -> Vec<PyramidMark> {
    let mut marks = Vec::new();
    pyramid.draw(from, to, column, |mark| marks.push(mark));
    marks
}

#[test]
fn every_column_has_the_extremes_of_its_samples_and_every_gap_breaks_it() {
    let mut random = SplitMix::seeded(11);
    for round in 0..400 {
        let count = 1 + random.below(if round % 10 == 0 { 40_000 } else { 900 });
        let raw = values(&mut random, count, round % 3 > 0);
        let pyramid = pyramid(&mut random, &raw);
        assert_eq!(pyramid.len(), count);
        let column = 1 << random.below(14);
        let from = random.below(count);
        let to = from + 1 + random.below(count - from);
        let marks = drawn(&pyramid, from, to, column);
        let points: Vec<(usize, f32)> = marks
            .iter()
            .filter_map(|mark| match *mark {
                PyramidMark::Point(index, value) => Some((index, value)),
                PyramidMark::Gap => None,
            })
            .collect();
        assert!(points.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert!(points.iter().all(|&(index, value)| raw[index] == value));
        for first in (from / column * column..to).step_by(column) {
            let range = match column {
                1 => first..first + 1,
                _ => first..(first + column).min(count),
            };
            let own = raw[range.clone()].iter().filter(|one| one.is_finite());
            let low = own.clone().copied().reduce(f32::min);
            let high = own.copied().reduce(f32::max);
            let shown = points.iter().filter(|one| range.contains(&one.0));
            let shown: Vec<f32> = shown.map(|one| one.1).collect();
            assert!(shown.len() <= 2, "{shown:?}");
            assert_eq!(shown.iter().copied().reduce(f32::min), low, "{range:?}");
            assert_eq!(shown.iter().copied().reduce(f32::max), high, "{range:?}");
        }
        // A gap stands exactly where there is one between two points.
        let mut before: Option<usize> = None;
        let mut has_gap = false;
        for mark in &marks {
            match *mark {
                PyramidMark::Gap => has_gap = true,
                PyramidMark::Point(index, _) => {
                    if let Some(before) = before {
                        let is_broken = raw[before..index].iter().any(|one| !one.is_finite());
                        assert_eq!(has_gap, is_broken, "{before}..{index} by {column}");
                    }
                    (before, has_gap) = (Some(index), false);
                }
            }
        }
    }
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
        assert_eq!(found.map(|ends| ends[0].1), low, "{from}..{to}");
        assert_eq!(found.map(|ends| ends[1].1), high, "{from}..{to}");
        for (index, value) in found.into_iter().flatten() {
            assert!((from..to).contains(&index) && raw[index] == value);
        }
    }
}

#[test]
fn nothing_one_sample_and_ranges_beyond_the_end_are_drawn() {
    let mut pyramid = Pyramid::default();
    assert!(drawn(&pyramid, 0, 10, 4).is_empty());
    assert_eq!(pyramid.extremes(0, 10), None);
    pyramid.extend([3.0]);
    for column in [1, 2, 16, 4096] {
        assert_eq!(drawn(&pyramid, 0, 1, column), [PyramidMark::Point(0, 3.0)]);
        assert!(drawn(&pyramid, 5, 9, column).is_empty());
    }
    let nothing = {
        let mut pyramid = Pyramid::default();
        pyramid.extend([f32::NAN; 100]);
        pyramid
    };
    assert!(drawn(&nothing, 0, 100, 64).iter().all(|mark| *mark == PyramidMark::Gap));
    assert_eq!(nothing.extremes(0, 100), None);
}

#[test]
fn there_are_at_most_two_points_a_pixel_and_the_memory_is_as_stated() {
    let mut random = SplitMix::seeded(13);
    let raw = values(&mut random, 1 << 20, false);
    let pyramid = pyramid(&mut random, &raw);
    let per_sample = pyramid.bytes() as f64 / raw.len() as f64;
    assert!((4.95..5.05).contains(&per_sample), "{per_sample}");
    for (samples, pixels) in [(1000, 800.0), (1601, 800.0), (40_000, 333.0), (1 << 20, 1600.0)] {
        let column = column_for(samples, pixels);
        let points = drawn(&pyramid, 0, samples, column).len();
        assert!(points as f64 <= 2.0 * pixels + 2.0, "{points}");
        // And not many fewer than there is room for.
        assert!(points as f64 >= 0.45 * pixels.min(samples as f64), "{points}");
    }
}

/// The mean, lowest and highest of every column are those of its samples; beside gaps the mean is between the two.
#[test]
fn columns_have_the_mean_of_their_samples() {
    let mut random = SplitMix::seeded(13);
    for round in 0..300 {
        let count = 1 + random.below(if round % 10 == 0 { 40_000 } else { 900 });
        let has_gaps = round % 2 == 1;
        let raw = values(&mut random, count, has_gaps);
        let pyramid = pyramid(&mut random, &raw);
        let column = 1 << random.below(14);
        let mut next = 0;
        pyramid.columns(0, count, column, |at, found| {
            assert_eq!(at, next);
            next += column;
            let own = &raw[at..(at + column).min(count)];
            let known = || own.iter().copied().filter(|one| one.is_finite());
            let Some(found) = found else { return assert_eq!(known().count(), 0) };
            assert_eq!(Some(found.low), known().reduce(f32::min));
            assert_eq!(Some(found.high), known().reduce(f32::max));
            assert_eq!(found.has_gap, known().count() < own.len());
            let mean = known().map(f64::from).sum::<f64>() / known().count() as f64;
            // An f32 has 24 bits, and a column at most seven levels that each round once; values are below 32.
            let is_near = (f64::from(found.mean) - mean).abs() < 7.0 * 32.0 / f64::from(1 << 24);
            assert!(is_near || found.has_gap, "{} instead of {mean}", found.mean);
            assert!((found.low..=found.high).contains(&found.mean));
        });
        assert!(next >= count);
    }
}
