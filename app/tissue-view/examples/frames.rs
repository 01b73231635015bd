//! Frame times of each level of detail on this computer's adapter: `cargo run -p palpate-tissue-view --example frames`.
//!
//! 1280 by 800 pixels and a dent that changes in every frame: in 201 by 201 nodes of a square, and in the 50 240
//! triangles of the stomach. "draw" is until the adapter has drawn the picture and its copy to the window; "hand over" is what
//! the thread of the window spends on it: places made ready, normals, upload, encoding. The last line of each is the level
//! that is chosen from these times.

mod dent;
mod organ;

use dent::Dent;
use organ::Organ;
use palpate_tissue_view::{
    DetailLevel, EyeLayout, FieldData, LEVELS, LevelChooser, OffScreen, Picture, PictureShape,
    Screen, SurfaceData, SurfaceStyle,
};
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

const SIZE: [u32; 2] = [1280, 800];
const FRAMES: usize = 40;

/// What the dent is, this times as deep.
type Deform<'a> = Box<dyn Fn(f64) -> Result<SurfaceData, Box<dyn Error>> + 'a>;

struct Bench<'a> {
    off_screen: &'a mut OffScreen,
    screen: &'a Screen,
    picture: Picture,
    deform: Deform<'a>,
    frame: u32,
}

impl Bench<'_> {
    /// One frame: the times of handing it over and of all of it.
    #[expect(clippy::disallowed_methods, reason = "an example that measures time")]
    fn frame(&mut self, level: DetailLevel) -> Result<[Duration; 2], Box<dyn Error>> {
        self.frame += 1;
        let depth = 1.0 - 0.1 * (f64::from(self.frame) * 0.3).sin();
        let start = Instant::now();
        self.picture.surface = Arc::new((self.deform)(depth)?);
        self.picture.level = level;
        self.off_screen.submit(&self.picture, self.screen);
        let handed = start.elapsed();
        self.off_screen.wait()?;
        Ok([handed, start.elapsed()])
    }

    #[expect(clippy::print_stdout, reason = "an example that prints what it measures")]
    fn run(&mut self) -> Result<(), Box<dyn Error>> {
        for level in LEVELS {
            // The first frame compiles.
            self.frame(level)?;
            let times = (0..FRAMES).map(|_| self.frame(level)).collect::<Result<Vec<_>, _>>()?;
            let [handed, all] =
                [0, 1].map(|of| milliseconds(times.iter().map(|one| one[of]).collect()));
            let shown = self.picture.surface.level(self.off_screen.abilities().possible(level));
            println!(
                "draw {:6.1} {:6.1}   hand over {:5.2} {:5.2}   {shown}",
                all[0], all[1], handed[0], handed[1],
            );
        }
        let mut chooser = LevelChooser::starting_at(self.off_screen.abilities().first_level);
        let mut last = Vec::new();
        for frame in 0..200 {
            let [_, all] = self.frame(chooser.level())?;
            if frame >= 150 {
                last.push(all);
            }
            chooser.record(all.as_secs_f64() * 1e3);
        }
        let [median, late] = milliseconds(last);
        let shown = self.picture.surface.level(chooser.level());
        println!("chosen: {shown}: {median:.1} {late:.1}, {:.0} frames/s", 1e3 / median);
        Ok(())
    }
}

fn milliseconds(mut times: Vec<Duration>) -> [f64; 2] {
    times.sort_unstable();
    [times.len() / 2, times.len() * 9 / 10].map(|index| times[index].as_secs_f64() * 1e3)
}

#[expect(clippy::print_stdout, reason = "an example that prints what it measures")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut off_screen = OffScreen::new()?;
    println!("{}, {} x {} pixels", off_screen.adapter(), SIZE[0], SIZE[1]);
    println!("median and 90 % of {FRAMES} frames, in ms");
    let screen = off_screen.screen(SIZE);
    let (dent, organ) = (Dent::haptic()?, Organ::stomach()?);
    let rest = vec![0.0; dent.heights.len()];
    let field: Deform = Box::new(|times| {
        let heights: Vec<f64> = dent.heights.iter().map(|height| height * times).collect();
        let field = FieldData::new(dent::NODES, dent.spacing_mm(), &heights)?;
        Ok(SurfaceData::Field(field.with_rest(&rest)?))
    });
    let mesh: Deform =
        Box::new(|times| Ok(SurfaceData::Mesh(organ.shape.displaced(organ.moved(times))?)));
    let shape = PictureShape::new(SIZE.map(f64::from), EyeLayout::Single);
    let mut look = SurfaceStyle::tissue(SurfaceStyle::LIGHT);
    look.thickness_mm = 9.0;
    for (name, deform, probe, camera) in [
        ("a square of 201 x 201 nodes", field, Some(dent.probe), dent.camera()),
        ("a stomach of 50 240 triangles", mesh, organ.probe, organ.camera(shape)),
    ] {
        println!("{name}");
        let picture = Picture {
            surface: Arc::new(deform(1.0)?),
            probe,
            camera,
            eyes: EyeLayout::Single,
            look: look.clone(),
            level: LEVELS[0],
        };
        Bench { off_screen: &mut off_screen, screen: &screen, picture, deform, frame: 0 }.run()?;
    }
    Ok(())
}
