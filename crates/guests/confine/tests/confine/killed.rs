//! A launcher that is killed.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use guest::Patience;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Pid, PidfdFlags, pidfd_open};

use crate::{Case, marked};

/// The launcher, as its own process: it tells the mark of a running guest and waits to be killed.
#[test]
#[ignore = "a part of the test below"]
fn launcher_that_is_killed() {
    let case = Case::shell("trap '' TERM HUP; read line; echo ready; while :; do sleep 100; done", "");
    let mut channel = case.launch().unwrap();
    channel.exchange("start", Patience::Start).unwrap();
    println!("\nmark {}", case.mark);
    std::io::stdin().read_line(&mut String::new()).unwrap();
}

#[test]
fn a_killed_launcher_leaves_nothing() {
    let mut launcher = Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "killed::launcher_that_is_killed", "--nocapture"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(launcher.stdout.take().unwrap()).lines().map_while(Result::ok);
    let mark = lines.find_map(|line| line.strip_prefix("mark ").map(str::to_owned)).unwrap();
    let running = marked(&mark);
    assert!(running.len() >= 3, "entry, warden and guest: {running:?}");
    let open = |pid: &i32| pidfd_open(Pid::from_raw(*pid).unwrap(), PidfdFlags::empty()).unwrap();
    let ends: Vec<_> = running.iter().map(open).collect();
    launcher.kill().unwrap();
    launcher.wait().unwrap();
    for end in &ends {
        // Readable once the process has ended. The limit is that of a test that has failed.
        let limit = rustix::event::Timespec { tv_sec: 60, tv_nsec: 0 };
        assert_eq!(poll(&mut [PollFd::new(end, PollFlags::IN)], Some(&limit)), Ok(1), "a process of the guest goes on");
    }
    assert!(marked(&mark).is_empty());
}
