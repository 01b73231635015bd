use super::*;
use palpate_runner::wall_now;

fn desk(runs: u32) -> (RemoteDesk, SystemTime) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("speeds.toml");
    let text = format!(
        "format = \"palpate-remote-queue 1\"\nname = \"speeds\"\nprotocol = \"ramp-hold\"\nruns = {runs}\n\
         [choose.speed]\nfrom = \"1 mm/s\"\nto = \"8 mm/s\"\n"
    );
    std::fs::write(&file, text).unwrap();
    let queue = RemoteQueue::read(&file, None).unwrap();
    let (mut desk, now) = (RemoteDesk::default(), wall_now());
    desk.arm(queue, now, Duration::from_mins(10)).unwrap();
    (desk, now)
}

fn request(speed: &str) -> RemoteRequest {
    RemoteRequest {
        queue: "speeds".into(),
        values: BTreeMap::from([("speed".to_owned(), speed.to_owned())]),
        remark: String::new(),
    }
}

/// A rig that can run everything.
fn any(_: &Plan) -> Result<(), String> {
    Ok(())
}

#[test]
fn nothing_runs_that_is_not_armed() {
    let mut idle = RemoteDesk::default();
    let now = wall_now();
    let refusal = idle.ask(request("2 mm/s"), "a", now, any).unwrap_err();
    assert!(refusal.to_string().contains("none was armed yet"), "{refusal}");
    let (mut desk, now) = desk(3);
    let other = RemoteRequest { queue: "forces".into(), ..request("2 mm/s") };
    assert!(matches!(desk.ask(other, "a", now, any), Err(RemoteRefusal::OtherQueue { .. })));
    assert!(matches!(desk.ask(request("9 mm/s"), "a", now, any), Err(RemoteRefusal::Values(_))));
    assert_eq!(desk.ask(request("2 mm/s"), "a", now, any).unwrap().id, 1);
    // Its time is over: what waits is withdrawn, and nothing starts.
    let later = now + Duration::from_mins(10);
    assert!(desk.next(later).is_none());
    assert_eq!(desk.run(1).unwrap().state, RemoteRunState::Withdrawn);
    assert!(desk.armed().is_none());
    let refusal = desk.ask(request("2 mm/s"), "a", later, any).unwrap_err();
    assert!(refusal.to_string().contains("its time is over"), "{refusal}");
}

#[test]
fn a_range_with_an_end_that_the_rig_cannot_run_is_named() {
    let (desk, _) = desk(3);
    let queue = &desk.arming.as_ref().unwrap().queue;
    assert!(queue.check(any).is_ok());
    for end in ["1 mm/s", "8 mm/s"] {
        let check = |plan: &Plan| match plan.source.as_ref().unwrap().values["speed"] == end {
            true => Err("the motor cannot do this speed".to_owned()),
            false => Ok(()),
        };
        let refusal = queue.check(check).unwrap_err();
        let words = format!("speed = {end} cannot be run: the motor cannot do this speed");
        assert!(refusal.to_string().contains(&words), "{refusal}");
    }
}

#[test]
fn a_stop_beside_a_start_is_before_it_or_passed_on_again() {
    let begin = || {
        let (mut desk, now) = desk(3);
        desk.ask(request("2 mm/s"), "a", now, any).unwrap();
        let (id, _, _) = desk.next(now).unwrap();
        (desk, id)
    };
    // The stop comes while the start is prepared: the runner is never asked.
    let (mut desk, id) = begin();
    assert!(!desk.disarm_for_stop("a stop"));
    let refusal = desk.send(id, || panic!("asked for behind the stop")).unwrap_err();
    assert!(refusal.contains("taken back: a stop"), "{refusal}");
    assert_eq!(desk.run(id).unwrap().state, RemoteRunState::Withdrawn);
    // The start was asked for between the stop and the taking back: it stands behind the stop.
    let (mut desk, id) = begin();
    desk.send(id, || Ok(())).unwrap();
    assert!(desk.disarm_for_stop("a stop"));
    // The run is known to be in progress: the stop has reached it.
    let (mut desk, id) = begin();
    desk.send(id, || Ok(())).unwrap();
    desk.begun(id, PathBuf::from("session"));
    assert!(!desk.disarm_for_stop("a stop"));
    assert_eq!(desk.run(id).unwrap().state, RemoteRunState::Running);
}

#[test]
fn every_ending_but_finish_takes_the_arming_back() {
    use EndingKind::{Abort, Finish, Halt, Interlock, Stop};
    for ending in [Finish, Stop, Abort, Halt, Interlock] {
        let (mut desk, now) = desk(3);
        desk.ask(request("2 mm/s"), "a", now, any).unwrap();
        desk.ask(request("3 mm/s"), "a", now, any).unwrap();
        let (id, _, _) = desk.next(now).unwrap();
        assert!(desk.next(now).is_none(), "one at a time");
        desk.ended(id, ending, "why");
        let is_armed = desk.armed().is_some();
        assert_eq!(is_armed, ending == Finish);
        assert_eq!(desk.next(now).is_some(), is_armed, "{ending}");
    }
}

#[test]
fn an_arming_has_so_many_runs() {
    let (mut desk, now) = desk(2);
    desk.ask(request("2 mm/s"), "a", now, any).unwrap();
    desk.ask(request("3 mm/s"), "a", now, any).unwrap();
    assert_eq!(desk.ask(request("4 mm/s"), "a", now, any).unwrap_err(), RemoteRefusal::Used);
    desk.withdraw(2, "a").unwrap();
    assert_eq!(desk.withdraw(2, "a"), Err(RemoteRefusal::NotWaiting(2)));
    desk.ask(request("4 mm/s"), "a", now, any).unwrap();
    for id in [1, 3] {
        assert_eq!(desk.next(now).unwrap().0, id);
        desk.ended(id, EndingKind::Finish, "");
    }
    assert!(desk.armed().is_none());
    assert!(desk.state(10).disarmed.unwrap().contains("used"));
}

#[test]
fn a_busy_rig_starts_nothing() {
    let (mut desk, now) = desk(2);
    desk.ask(request("2 mm/s"), "a", now, any).unwrap();
    desk.set_busy(Some("the haptic loop runs".into()));
    assert!(desk.next(now).is_none());
    desk.set_busy(None);
    assert!(desk.next(now).is_some());
}

#[test]
fn what_is_remembered_is_bounded() {
    let (mut desk, now) = desk(1000);
    for number in 0..2000 {
        let asked = desk.ask(request("2 mm/s"), "a", now, any).map(|run| run.id);
        match asked {
            Ok(id) if number % 2 == 0 => desk.withdraw(id, "a").unwrap(),
            Ok(_) => {}
            Err(refusal) => assert_eq!(refusal, RemoteRefusal::Full),
        }
        assert!(desk.runs.len() <= REMEMBERED_MAX);
        assert!(desk.waiting().count() <= WAITING_MAX);
    }
    assert_eq!(desk.waiting().count(), WAITING_MAX);
}
