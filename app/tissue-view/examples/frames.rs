//! Frame times of each level of detail on this computer's adapter: `cargo run -p palpate-tissue-view --example frames`.
//!
//! 1280 by 800 pixels, 201 by 201 nodes, a dent whose heights change in every frame. "draw" is until the adapter has drawn
//! the picture and its copy to the window; "hand over" is what the thread of the window spends on it: heights made ready,
//! upload, encoding. The second line is the level that is chosen from these times.

mod dent;

use dent::Dent;
use palpate_tissue_view::{
    DetailLevel, EyeLayout, FieldData, LEVELS, LevelChooser, OffScreen, Picture, Screen,
    SurfaceData, SurfaceStyle,
};
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

const SIZE: [u32; 2] = [1280, 800];
const FRAMES: usize = 40;

struct Bench {
    off_screen: OffScreen,
    screen: Screen,
    picture: Picture,
    heights: Vec<f64>,
    dent: Dent,
    frame: u32,
}

impl Bench {
    /// One frame: the times of handing it over and of all of it.
    #[expect(clippy::disallowed_methods, reason = "an example that measures time")]
    fn frame(&mut self, level: DetailLevel) -> Result<[Duration; 2], Box<dyn Error>> {
        self.frame += 1;
        let depth = 1.0 - 0.1 * (f64::from(self.frame) * 0.3).sin();
        let heights: Vec<f64> = self.heights.iter().map(|height| height * depth).collect();
        let rest = vec![0.0; heights.len()];
        let start = Instant::now();
        let field = FieldData::new(dent::NODES, self.dent.spacing_mm(), &heights)?;
        let field = field.with_rest(&rest)?;
        self.picture.surface = Arc::new(SurfaceData::Field(field));
        self.picture.level = level;
        self.off_screen.submit(&self.picture, &self.screen);
        let handed = start.elapsed();
        self.off_screen.wait()?;
        Ok([handed, start.elapsed()])
    }
}

fn milliseconds(mut times: Vec<Duration>) -> [f64; 2] {
    times.sort_unstable();
    [times.len() / 2, times.len() * 9 / 10].map(|index| times[index].as_secs_f64() * 1e3)
}

#[expect(clippy::print_stdout, reason = "an example that prints what it measures")]
fn main() -> Result<(), Box<dyn Error>> {
    let dent = Dent::haptic()?;
    let off_screen = OffScreen::new()?;
    let mut look = SurfaceStyle::tissue(SurfaceStyle::LIGHT);
    look.thickness_mm = 9.0;
    let picture = Picture {
        surface: Arc::new(SurfaceData::Field(dent.field.clone())),
        probe: Some(dent.probe),
        camera: dent.camera(),
        eyes: EyeLayout::Single,
        look,
        level: LEVELS[0],
    };
    println!("{}, {} x {} pixels", off_screen.adapter(), SIZE[0], SIZE[1]);
    println!("median and 90 % of {FRAMES} frames, in ms");
    let screen = off_screen.screen(SIZE);
    let heights = dent.heights.clone();
    let mut bench = Bench { off_screen, screen, picture, heights, dent, frame: 0 };
    for level in LEVELS {
        // The first frame compiles.
        bench.frame(level)?;
        let times = (0..FRAMES).map(|_| bench.frame(level)).collect::<Result<Vec<_>, _>>()?;
        let [handed, all] =
            [0, 1].map(|of| milliseconds(times.iter().map(|one| one[of]).collect()));
        println!(
            "draw {:6.1} {:6.1}   hand over {:5.2} {:5.2}   {}",
            all[0],
            all[1],
            handed[0],
            handed[1],
            bench.off_screen.abilities().possible(level)
        );
    }
    let first = bench.off_screen.abilities().first_level;
    let mut chooser = LevelChooser::starting_at(first);
    let mut last = Vec::new();
    for frame in 0..200 {
        let [_, all] = bench.frame(chooser.level())?;
        if frame >= 150 {
            last.push(all);
        }
        chooser.record(all.as_secs_f64() * 1e3);
    }
    let [median, late] = milliseconds(last);
    println!("chosen: {}: {median:.1} {late:.1}, {:.0} frames/s", chooser.level(), 1e3 / median);
    Ok(())
}
