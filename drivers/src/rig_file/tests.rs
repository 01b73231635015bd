use super::*;
use crate::galil::{AnalogRange, GalilSettings, Sampling};
use crate::grbl::GrblSettings;
use palpate_model::rig::RigDescription;
use palpate_model::units::Position;

const THESIS: &str = r#"# The slide of the source thesis
device = "galil"
port = "/dev/ttyUSB0"
mm_per_pulse = 0.015
travel_mm = 150
speed_max_mm_s = 20
acceleration_mm_s2 = 61.44
converter = "16 bit"
"#;

fn galil(file: &str, text: &str) -> (DeviceAddress, GalilSettings) {
    assert_eq!(RigFile::parse(file, text).unwrap().places().len(), 1);
    let mut fields = Fields::read(text).unwrap();
    let name = fields.text("name").unwrap_or_else(|| stem(file));
    super::galil::read(name, &mut fields).unwrap()
}

fn grbl_settings(text: &str) -> (DeviceAddress, GrblSettings) {
    super::grbl::read("bench".into(), &mut Fields::read(text).unwrap()).unwrap()
}

fn mistakes(text: &str) -> Vec<(usize, String)> {
    RigFile::parse("bench.toml", text)
        .unwrap_err()
        .mistakes
        .into_iter()
        .map(|mistake| (mistake.line, mistake.message))
        .collect()
}

#[test]
fn missing_keys_have_usual_values() {
    let (place, galil) = galil("rigs/bench 2.toml", THESIS);
    assert_eq!(
        place,
        DeviceAddress::Serial { port: "/dev/ttyUSB0".into(), baud: 115_200, has_handshake: false }
    );
    assert_eq!(galil.name, "bench 2");
    assert_eq!((galil.axis, galil.input), ('A', 1));
    assert_eq!(galil.range, AnalogRange::Bipolar10);
    assert_eq!(galil.noise.0, 20.0 / 65_536.0);
    assert!(galil.has_watchdog && !galil.is_reversed);
    assert_eq!((galil.sampling, galil.sample_us), (Sampling::Auto, None));
}

#[test]
fn every_key_is_read() {
    let text = THESIS.replace("port = \"/dev/ttyUSB0\"", "address = \"10.0.0.5:23\"")
        + r#"
name = "left bench"
axis = "C"
input = 3
direction = "reverse"
motor_type = "active-high"
limit_switches = "active-high"
home_switch = "active-high"
range = "0..5 V"
noise_v = 0.002
filter = "RC low-pass, 100 Hz"
serial_number = 1820
watchdog = false
sampling = "record"
sample_us = 500
"#;
    let (place, galil) = galil("x.toml", &text);
    assert_eq!(place, DeviceAddress::Tcp("10.0.0.5:23".into()));
    assert_eq!(galil.name, "left bench");
    assert_eq!((galil.axis, galil.input), ('C', 3));
    assert_eq!(galil.sign(), -1);
    assert_eq!(galil.serial_number, Some(1820));
    assert_eq!(galil.filter.as_deref(), Some("RC low-pass, 100 Hz"));
    assert!(!galil.has_watchdog);
    assert_eq!(galil.sampling, Sampling::Record);
    assert_eq!(galil.sample_us, Some(500));
}

#[test]
fn every_mistake_is_reported_with_its_line() {
    let text = THESIS
        .replace("0.015", "\"0.015\"")
        .replace("travel_mm = 150", "travel = 150")
        .replace("\"16 bit\"", "16")
        + "axis = \"Q\"\n";
    let found = mistakes(&text);
    let lines: Vec<usize> = found.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [0, 4, 5, 8, 9], "{found:?}");
    assert!(found[0].1.contains("travel_mm"));
    assert!(found[2].1.contains("'travel'"));
    assert!(found[3].1.contains("\"12 bit\" or \"16 bit\""));
    let all = RigFile::parse("bench.toml", &text).unwrap_err().to_string();
    assert!(all.contains("bench.toml, line 9: axis: "), "{all}");
}

#[test]
fn keys_that_exclude_each_other_are_mistakes() {
    let both = format!("{THESIS}address = \"10.0.0.5:23\"\n");
    assert!(mistakes(&both)[0].1.contains("not both"));
    let nowhere = THESIS.replace("port = \"/dev/ttyUSB0\"\n", "");
    assert!(mistakes(&nowhere)[0].1.contains("controller"));
    let slow = THESIS.replace("61.44", "5");
    assert!(mistakes(&slow)[0].1.contains("15.36"));
    let other = THESIS.replace("\"galil\"", "\"marlin\"");
    assert!(mistakes(&other)[0].1.contains("give \"galil\""));
}

#[test]
fn a_text_that_is_no_rig_file_is_a_mistake() {
    assert_eq!(mistakes("device = \"galil")[0].0, 1);
    assert!(mistakes(&"#".repeat(BYTES_MAX + 1))[0].1.contains("not a rig file"));
    assert_eq!(mistakes("").len(), 1);
    assert!(mistakes("device = \"galil\"").len() > 3);
    assert!(mistakes(&THESIS.replace("150", "inf"))[0].1.contains("travel_mm"));
}

const PARTS: &str = r#"device = "grbl"
port = "/dev/ttyACM0"
mm_per_pulse = 0.0025
travel_mm = 150
speed_max_mm_s = 20
acceleration_mm_s2 = 60
home_switch = "probe"

[cell]
device = "hx711"
port = "/dev/ttyACM1"
"#;

#[test]
fn rig_of_controller_and_cell_has_two_addresses() {
    let file = RigFile::parse("bench.toml", PARTS).unwrap();
    let ports: Vec<String> = file.places().iter().map(ToString::to_string).collect();
    assert_eq!(ports, ["/dev/ttyACM0 at 115200 baud", "/dev/ttyACM1 at 115200 baud"]);
    let gauge = PARTS.replace("hx711", "mark10") + "capacity_n = 25\nfilter = 4\n";
    assert_eq!(RigFile::parse("bench.toml", &gauge).unwrap().places().len(), 2);
    let (_, settings) = grbl_settings(&gauge);
    assert!(!settings.is_unlocking && settings.axis == 'X');
    let gauge = super::gauge(&mut Fields::read(&gauge).unwrap()).unwrap();
    assert_eq!((gauge.capacity.0, gauge.filter), (25.0, Some(4)));
}

#[test]
fn mistakes_of_controller_and_cell_are_reported_together() {
    let text = PARTS.replace("\"probe\"", "\"none\"").replace("\"hx711\"", "\"mark10\"")
        + "board = \"A\"\nreadings_per_second = 60\n";
    let found = mistakes(&text);
    let lines: Vec<usize> = found.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [0, 7, 12, 13], "{found:?}");
    assert!(found[0].1.contains("cell.capacity_n: this key is missing"));
    assert!(found[2].1.contains("'cell.board' is not a key"));
    let one = PARTS.replace("ttyACM1", "ttyACM0");
    assert!(mistakes(&one)[0].1.contains("another"));
}

#[test]
fn a_stand_is_one_device() {
    let text = "device = \"mark10-stand\"\nport = \"/dev/ttyUSB0\"\ntravel_mm = 300\nspeed_max_mm_s = 10\n\
        acceleration_mm_s2 = 100\n[cell]\ncapacity_n = 25\n";
    let file = RigFile::parse("stand.toml", text).unwrap();
    assert_eq!(file.places().len(), 1);
}

#[test]
fn fractions_of_what_is_whole_are_refused_with_their_line() {
    let text = THESIS.to_owned()
        + "input = 1.9\nserial_number = 1820.7\nsample_us = 976.6\nbaud = 9600.5\n";
    let found = mistakes(&text);
    let lines: Vec<usize> = found.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [9, 10, 11, 12], "{found:?}");
    assert!(found[0].1.contains("input: "));
    let gauge = PARTS.replace("hx711", "mark10")
        + "capacity_n = 25\nfilter = 4.5\nreadings_per_second = 50.5\nbaud = 9600.5\n";
    let found = mistakes(&gauge);
    let lines: Vec<usize> = found.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [13, 14, 15], "{found:?}");
    // A whole number may be written with a point.
    let whole = THESIS.to_owned() + "input = 2.0\n";
    assert_eq!(galil("bench.toml", &whole).1.input, 2);
}

#[test]
fn settings_that_a_grbl_board_cannot_have_are_mistakes() {
    let fine = PARTS.replace("0.0025", "0.000625");
    let found = mistakes(&fine);
    assert!(found[0].0 == 3 && found[0].1.contains("thousandths"), "{found:?}");
    let probe = PARTS.replace("\"probe\"\n", "\"probe\"\nclosed_is_home = true\n");
    assert_eq!(mistakes(&probe)[0].0, 8);
    let limit = probe.replace("\"probe\"", "\"limit\"");
    assert_eq!(RigFile::parse("bench.toml", &limit).unwrap().places().len(), 2);
    assert!(grbl_settings(&limit).1.is_closed_home);
}

#[test]
fn unseen_mm_of_the_file_limits_motion_without_samples() {
    let usual = galil("bench.toml", THESIS).1.unseen;
    assert_eq!(usual, RigDescription::UNSEEN_USUAL);
    let further = THESIS.to_owned() + "unseen_mm = 0.3\n";
    assert_eq!(galil("bench.toml", &further).1.unseen, Position(0.3));
    let found = mistakes(&(THESIS.to_owned() + "unseen_mm = 5\n"));
    assert!(found[0].1.contains("unseen_mm: ") && found[0].1.contains("0.02 to 0.5"));
}

#[test]
fn a_sidecar_is_a_program_a_port_or_an_address() {
    let limits = "speed_max_mm_s = 5\n";
    let read = |text: &str| {
        RigFile::parse("rigs/stage.toml", &format!("device = \"sidecar\"\n{text}{limits}"))
    };
    let words = ["python3", "my_stage.py"].map(str::to_owned).to_vec();
    let program = read("program = [\"python3\", \"my_stage.py\"]\n").unwrap();
    let folder = std::path::PathBuf::from("rigs");
    assert_eq!(program.places(), [DeviceAddress::Program { words, folder }]);
    assert!(
        read("port = \"/dev/ttyUSB0\"\n").is_ok() && read("address = \"10.0.0.5:4000\"\n").is_ok()
    );
    for wrong in ["", "program = []\n", "program = \"python3\"\n", "program = [\"a\", 1]\n"] {
        let err = read(wrong).unwrap_err();
        assert!(err.to_string().contains("p"), "{err}");
    }
    let err = RigFile::parse("s.toml", "device = \"sidecar\"\nport = \"a\"\n").unwrap_err();
    assert!(err.to_string().contains("speed_max_mm_s: this key is missing"), "{err}");
}

#[test]
fn sensors_stand_in_tables_of_their_own_beside_any_rig() {
    let sensors =
        "[sensors.room]\nprogram = [\"room\"]\n[sensors.camera]\nport = \"/dev/ttyACM9\"\n";
    let file = RigFile::parse("bench.toml", &format!("{THESIS}{sensors}")).unwrap();
    let places: Vec<String> = file.places().iter().map(ToString::to_string).collect();
    assert_eq!(places[1..], ["room in .", "/dev/ttyACM9 at 115200 baud"]);
    let cell = PARTS.replace("hx711", "sidecar") + sensors;
    assert_eq!(RigFile::parse("bench.toml", &cell).unwrap().places().len(), 4);
    for (from, to, line) in [
        ("program = [\"room\"]", "", 0),
        ("program", "programme", 0),
        ("sensors.camera", "sensors.\"a b\"", 0),
        ("port", "spelling = 1\nport", 0),
    ] {
        let text = format!("{THESIS}{}", sensors.replace(from, to));
        let found = mistakes(&text);
        assert!(!found.is_empty() && found[0].0 >= line, "{from}: {found:?}");
    }
}
