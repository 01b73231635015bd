//! Force over depth as a line on a screen: x goes back and forth, so no column of pixels can stand for a stretch.
//!
//! A stretch of the record is left out where every small cell of the screen that it crosses is crossed by what
//! is drawn already, as by the hundredth loop over the same place; what is left is made straight where that
//! moves it by little (Douglas & Peucker, Cartographica 10 (1973) 112-122).
//!
//! Every sample within the picture is at most [`ERROR_PIXELS`] from the line drawn, and every place on the line
//! at most that far from the line through all samples: the diagonal of a cell and what is made straight add up
//! to it. Memory while it works: a bit for each cell, 16 for each pixel.
//!
//! Where so much of the picture is crossed that a line would have more points than can be drawn in a frame, the cells
//! themselves are the picture ([`PolylineReducer::coverage`]).

/// The furthest that a sample left out is from the line drawn, in pixels.
pub const ERROR_PIXELS: f64 = 0.5;
/// Part of it for straightening.
const STRAIGHT: f64 = 0.146;
/// Side of a cell in pixels. Its diagonal is what is left of the error: (0.5 - 0.146) / sqrt(2).
const CELL: f64 = 0.25;

/// A line in pixels, reduced as it comes.
#[derive(Clone, Debug)]
pub struct PolylineReducer {
    size: [f64; 2],
    cells: [usize; 2],
    covered: Vec<u64>,
    /// Points of the stretch being drawn; empty while the pen is up.
    stretch: Vec<[f64; 2]>,
    before: Option<[f64; 2]>,
    /// Whether the newest sample stands alone so far.
    is_alone: bool,
    done: Vec<Vec<[f64; 2]>>,
    samples: u64,
    /// Points in `done`, and how many there may be.
    points: [usize; 2],
}

/// Coverage of every pixel by the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PixelCoverage {
    /// Pixels across and up.
    pub size: [usize; 2],
    /// From the corner where both axes begin, row by row: 0 to 255, which is a line straight across and more.
    pub pixels: Vec<u8>,
}

impl PolylineReducer {
    /// For a picture of so many pixels each way. What lies outside is left out.
    #[must_use]
    pub fn new(width: f64, height: f64) -> Self {
        let size = [width, height].map(|side| side.clamp(1.0, 1e5));
        let cells = size.map(|side| (side / CELL).ceil() as usize + 1);
        Self {
            size,
            cells,
            covered: vec![0; (cells[0] * cells[1]).div_ceil(64)],
            stretch: Vec::new(),
            before: None,
            is_alone: true,
            done: Vec::new(),
            samples: 0,
            points: [0, usize::MAX],
        }
    }

    /// A line of more than so many points becomes a picture.
    #[must_use]
    pub fn with_points_max(mut self, points_max: usize) -> Self {
        self.points[1] = points_max;
        self
    }

    /// The picture in the place of a line of too many points.
    pub fn coverage(&self) -> Option<PixelCoverage> {
        if !self.is_dense() {
            return None;
        }
        // Cells along a side of a pixel, as many as a straight line across it covers.
        let side = (1.0 / CELL) as usize;
        let size = self.size.map(|side| side.ceil() as usize);
        let crossed = |x: usize, y: usize| {
            let rows = (side * y..side * (y + 1)).filter(|row| *row < self.cells[1]);
            let row = |row: usize| {
                let cells = (side * x..side * (x + 1)).filter(|cell| *cell < self.cells[0]);
                cells.filter(|cell| self.bit([*cell, row])).count()
            };
            rows.map(row).sum::<usize>()
        };
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        Some(PixelCoverage {
            size,
            pixels: pixels.map(|(x, y)| (crossed(x, y) * 255 / side).min(255) as u8).collect(),
        })
    }

    fn is_dense(&self) -> bool {
        self.points[0] > self.points[1]
    }

    /// Takes the next sample, in pixels from a corner; one that is no number breaks the line.
    pub fn push(&mut self, x: f64, y: f64) {
        if !(x.is_finite() && y.is_finite()) {
            self.lift();
            return;
        }
        self.samples += 1;
        let to = [x, y];
        let Some(from) = self.before.replace(to) else {
            self.is_alone = true;
            return;
        };
        self.is_alone = false;
        let Some(inside) = self.clip(from, to) else {
            self.pen_up();
            return;
        };
        if self.is_covered(inside) {
            return;
        }
        if self.is_dense() {
            self.cover(inside);
            return;
        }
        // The pen may be a few samples behind; within one cell that is no more than the cell.
        match self.stretch.last() {
            Some(&last) if self.cell(last).is_some() && self.cell(last) == self.cell(from) => {
                if let Some(drawn) = self.clip(last, to) {
                    self.cover(drawn);
                }
            }
            _ => {
                self.pen_up();
                self.stretch.push(from);
                self.cover(inside);
            }
        }
        self.stretch.push(to);
    }

    /// Breaks the line.
    pub fn lift(&mut self) {
        if let (Some(place), true) = (self.before.take(), self.is_alone)
            && let Some(cell) = self.cell(place)
            && !self.bit(cell)
        {
            self.set(cell);
            self.keep(vec![place]);
        }
        self.is_alone = true;
        self.pen_up();
    }

    /// The stretches to draw, each of one point or more, and how many samples they stand for. There is none where
    /// [`coverage`](Self::coverage) is to be drawn.
    #[must_use]
    pub fn finish(mut self) -> (Vec<Vec<[f64; 2]>>, u64) {
        self.lift();
        (self.done, self.samples)
    }

    fn pen_up(&mut self) {
        if !self.stretch.is_empty() {
            let stretch = std::mem::take(&mut self.stretch);
            self.keep(straighten(&stretch, STRAIGHT));
        }
    }

    fn keep(&mut self, stretch: Vec<[f64; 2]>) {
        self.points[0] += stretch.len();
        if self.is_dense() {
            self.done.clear();
        } else {
            self.done.push(stretch);
        }
    }

    /// The cell of a place, unless it is outside.
    fn cell(&self, [x, y]: [f64; 2]) -> Option<[usize; 2]> {
        let is_in = (0.0..=self.size[0]).contains(&x) && (0.0..=self.size[1]).contains(&y);
        is_in.then(|| [(x / CELL) as usize, (y / CELL) as usize])
    }

    fn bit(&self, [x, y]: [usize; 2]) -> bool {
        let index = y * self.cells[0] + x;
        self.covered[index / 64] >> (index % 64) & 1 == 1
    }

    fn set(&mut self, [x, y]: [usize; 2]) {
        let index = y * self.cells[0] + x;
        self.covered[index / 64] |= 1 << (index % 64);
    }

    /// The part of a segment within the picture (Liang & Barsky, ACM Trans. Graph. 3 (1984) 1-22).
    fn clip(&self, from: [f64; 2], to: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let (mut start, mut end) = (0.0f64, 1.0f64);
        for axis in 0..2 {
            let way = to[axis] - from[axis];
            for (direction, room) in [(-way, from[axis]), (way, self.size[axis] - from[axis])] {
                if direction == 0.0 {
                    if room < 0.0 {
                        return None;
                    }
                } else if direction < 0.0 {
                    start = start.max(room / direction);
                } else {
                    end = end.min(room / direction);
                }
            }
        }
        let at = |share: f64| {
            std::array::from_fn(|axis| {
                let place = from[axis] + share * (to[axis] - from[axis]);
                place.clamp(0.0, self.size[axis])
            })
        };
        (start <= end).then(|| [at(start), at(end)])
    }

    fn is_covered(&self, line: [[f64; 2]; 2]) -> bool {
        let mut is_covered = true;
        walk(line, |cell| {
            is_covered = self.bit(cell);
            is_covered
        });
        is_covered
    }

    fn cover(&mut self, line: [[f64; 2]; 2]) {
        walk(line, |cell| {
            self.set(cell);
            true
        });
    }
}

/// Visits every cell that a line crosses, until `visit` returns false (Amanatides & Woo, Eurographics 1987, 3-10).
fn walk([from, to]: [[f64; 2]; 2], mut visit: impl FnMut([usize; 2]) -> bool) {
    let cell_of = |place: f64| (place / CELL) as i64;
    let mut cell = from.map(cell_of);
    let last = to.map(cell_of);
    let way = [to[0] - from[0], to[1] - from[1]];
    let step = way.map(|way| if way < 0.0 { -1 } else { 1 });
    // Share of the way to the next edge, and from edge to edge.
    let mut next: [f64; 2] = std::array::from_fn(|axis| {
        let edge = (cell[axis] + i64::from(step[axis] > 0)) as f64 * CELL;
        match way[axis] {
            0.0 => f64::INFINITY,
            way => (edge - from[axis]) / way,
        }
    });
    let between = way.map(|way| if way == 0.0 { f64::INFINITY } else { CELL / way.abs() });
    // As many steps as there are edges: rounding cannot make it go on.
    let steps = (last[0] - cell[0]).abs() + (last[1] - cell[1]).abs();
    for remaining in (0..=steps).rev() {
        if !visit(cell.map(|one| one.max(0) as usize)) || remaining == 0 {
            return;
        }
        let is_there = [cell[0] == last[0], cell[1] == last[1]];
        let axis = match is_there {
            [true, _] => 1,
            [_, true] => 0,
            _ => usize::from(next[1] < next[0]),
        };
        cell[axis] += step[axis];
        next[axis] += between[axis];
    }
}

/// The points of a line without those that are within `error` of the straight line over them.
fn straighten(points: &[[f64; 2]], error: f64) -> Vec<[f64; 2]> {
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut is_kept = vec![false; points.len()];
    is_kept[0] = true;
    is_kept[last] = true;
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let mut worst = (error, None);
        for (index, point) in points.iter().enumerate().take(to).skip(from + 1) {
            let distance = distance(*point, points[from], points[to]);
            if distance > worst.0 {
                worst = (distance, Some(index));
            }
        }
        if let Some(index) = worst.1 {
            is_kept[index] = true;
            open.extend([(from, index), (index, to)]);
        }
    }
    let kept = points.iter().zip(is_kept);
    kept.filter_map(|(point, is_kept)| is_kept.then_some(*point)).collect()
}

/// Distance of a point from the line between two others.
fn distance(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let own = [point[0] - from[0], point[1] - from[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    let along = match square {
        0.0 => 0.0,
        square => ((own[0] * way[0] + own[1] * way[1]) / square).clamp(0.0, 1.0),
    };
    (own[0] - along * way[0]).hypot(own[1] - along * way[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    fn reduced(points: &[[f64; 2]], size: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
        let mut reducer = PolylineReducer::new(size[0], size[1]);
        points.iter().for_each(|[x, y]| reducer.push(*x, *y));
        reducer.finish().0
    }

    fn lines(points: &[[f64; 2]]) -> Vec<[[f64; 2]; 2]> {
        let is_known = |one: &[f64; 2]| one.iter().all(|axis| axis.is_finite());
        let mut lines: Vec<_> = points
            .windows(2)
            .map(|pair| [pair[0], pair[1]])
            .filter(|pair| pair.iter().all(is_known))
            .collect();
        // A point alone is a line without length.
        lines.extend(points.iter().filter(|one| is_known(one)).map(|one| [*one; 2]));
        lines
    }

    fn furthest(places: &[[f64; 2]], lines: &[[[f64; 2]; 2]]) -> f64 {
        let nearest = |place: &[f64; 2]| {
            let distances = lines.iter().map(|line| distance(*place, line[0], line[1]));
            distances.fold(f64::INFINITY, f64::min)
        };
        places.iter().map(nearest).fold(0.0, f64::max)
    }

    /// Loops as of cycles that soften, with noise, each sample a fraction of a pixel on; gaps here and there.
    fn loops(random: &mut SplitMix, noise: f64, size: [f64; 2]) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        for cycle in 0..4 {
            let softer = 1.0 - 0.03 * f64::from(cycle);
            for i in 0..600 {
                let share = f64::from(i) / 300.0;
                let depth = if share < 1.0 { share } else { 2.0 - share };
                let force = softer * depth.powi(if share < 1.0 { 2 } else { 3 });
                // A little beyond the edges, as in a picture that is zoomed.
                let y = force * 1.2 * size[1] + noise * random.normal();
                points.push([depth * 1.2 * size[0] - 5.0, y]);
                if random.below(150) == 0 {
                    points.push([f64::NAN, 1.0]);
                }
            }
        }
        points
    }

    #[test]
    fn no_sample_is_further_from_the_line_than_stated_nor_the_line_from_the_samples() {
        let mut random = SplitMix::seeded(31);
        for noise in [0.0, 0.2, 3.0] {
            for size in [[200.0, 120.0], [60.0, 90.0]] {
                let points = loops(&mut random, noise, size);
                let stretches = reduced(&points, size);
                let drawn: Vec<_> = stretches.iter().flat_map(|one| lines(one)).collect();
                let inside = |one: &&[f64; 2]| {
                    (0.0..=size[0]).contains(&one[0]) && (0.0..=size[1]).contains(&one[1])
                };
                let samples: Vec<[f64; 2]> = points.iter().filter(inside).copied().collect();
                assert!(samples.len() > 500, "{}", samples.len());
                let away = furthest(&samples, &drawn);
                assert!(away <= ERROR_PIXELS, "{away} at noise {noise}");
                // Places along what is drawn, against the line through all samples.
                let along = drawn.iter().flat_map(|[a, b]| {
                    (0..=4).map(move |i| {
                        let share = f64::from(i) / 4.0;
                        [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
                    })
                });
                let along: Vec<[f64; 2]> = along.collect();
                let false_line = furthest(&along, &lines(&points));
                assert!(false_line <= ERROR_PIXELS, "{false_line} at noise {noise}");
            }
        }
    }

    #[test]
    fn loops_over_the_same_place_cost_hardly_anything_and_a_straight_line_two_points() {
        let size = [300.0, 200.0];
        let once: Vec<[f64; 2]> = (0..=20_000)
            .map(|i| f64::from(i) / 20_000.0)
            .map(|share| [280.0 * share, 150.0 * share])
            .collect();
        assert_eq!(reduced(&once, size), [vec![once[0], once[20_000]]]);
        let mut often = Vec::new();
        for _ in 0..50 {
            often.extend(once.iter().copied());
            often.extend(once.iter().rev().copied());
        }
        let count: usize = reduced(&often, size).iter().map(Vec::len).sum();
        // Where the way back cuts a corner of a cell that the way there did not.
        assert!(count <= 100, "{count} of {}", often.len());
    }

    #[test]
    fn points_alone_gaps_and_what_is_outside() {
        let nan = f64::NAN;
        let points = [[1.0, 1.0], [nan, 0.0], [5.0, 5.0], [nan, nan], [1.1, 1.1], [nan, 0.0]];
        assert_eq!(reduced(&points, [10.0, 10.0]), [vec![[1.0, 1.0]], vec![[5.0, 5.0]]]);
        assert!(reduced(&[[-3.0, 1.0], [-1.0, 40.0], [30.0, 40.0]], [10.0, 10.0]).is_empty());
        // Across the picture from outside to outside.
        let across = [[-5.0, 5.0], [15.0, 5.0]];
        assert_eq!(reduced(&across, [10.0, 10.0]), [across.to_vec()]);
        assert!(reduced(&[], [10.0, 10.0]).is_empty());
        assert_eq!(reduced(&[[2.0, 2.0]], [10.0, 10.0]), [vec![[2.0, 2.0]]]);
    }

    #[test]
    fn a_line_of_too_many_points_is_a_picture_of_what_it_crosses() {
        let mut random = SplitMix::seeded(32);
        let size = [120.0, 80.5];
        let points = loops(&mut random, 3.0, size);
        let mut reducer = PolylineReducer::new(size[0], size[1]).with_points_max(100);
        points.iter().for_each(|[x, y]| reducer.push(*x, *y));
        let coverage = reducer.coverage().expect("more than 100 points");
        assert_eq!(coverage.size, [120, 81]);
        assert!(reducer.finish().0.is_empty());
        let pixel = |x: usize, y: usize| coverage.pixels[y * coverage.size[0] + x];
        let inside = |one: &&[f64; 2]| (0..2).all(|axis| (0.0..size[axis]).contains(&one[axis]));
        for [x, y] in points.iter().filter(inside) {
            assert!(pixel(*x as usize, *y as usize) > 0, "{x} {y}");
        }
        // A pixel that is crossed is at most half its diagonal from the line.
        let crossed: Vec<[f64; 2]> = (0..81)
            .flat_map(|y| (0..120).map(move |x| (x, y)))
            .filter(|(x, y)| pixel(*x, *y) > 0)
            .map(|(x, y)| [x as f64 + 0.5, y as f64 + 0.5])
            .collect();
        assert!(crossed.len() > 500 && crossed.len() < 120 * 81);
        let away = furthest(&crossed, &lines(&points));
        assert!(away <= 0.5f64.sqrt() + 1e-9, "{away}");
        // With room for its points it is a line.
        let mut reducer = PolylineReducer::new(size[0], size[1]).with_points_max(points.len());
        points.iter().for_each(|[x, y]| reducer.push(*x, *y));
        assert_eq!(reducer.coverage(), None);
        assert_eq!(reducer.finish().0, reduced(&points, size));
    }

    #[test]
    fn a_straight_line_fills_its_pixels() {
        let mut reducer = PolylineReducer::new(10.0, 4.0).with_points_max(1);
        reducer.push(0.0, 1.5);
        reducer.push(10.0, 1.5);
        reducer.lift();
        let coverage = reducer.coverage().expect("two points");
        let row = |y: usize| &coverage.pixels[10 * y..10 * (y + 1)];
        assert_eq!((row(0), row(1), row(2)), (&[0; 10][..], &[255; 10][..], &[0; 10][..]));
    }
}
