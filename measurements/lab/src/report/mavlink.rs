//! Attacks on a MAVLink link: the object that `lab mavlink` prints, and its table.

use mavlink_relay::attack::{Attack, Link};
use mavlink_relay::class::{Measured, Required, Verdict, judge};
use mavlink_relay::end::EndFault;
use mavlink_relay::expected::{Cell, Row};
use mavlink_relay::finding;
use mavlink_relay::trial::Counts;
use results::report::new_table;
use serde::Serialize;
use stats::Share;

/// Messages of one party in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Party {
    /// Class that the published rules require.
    pub required: Required,
    /// Class that was measured; `None` without a message.
    pub measured: Option<Measured>,
    /// Messages handed to the application, of those that provably arrived; exact two-sided 95 % interval.
    pub accepted: Share,
}

impl Party {
    fn new(required: Required, accepted: u64, n: u64) -> Self {
        Self { required, measured: Measured::from_counts(accepted, n), accepted: Share::new(accepted, n) }
    }

    fn describe(&self) -> String {
        let class = |class: &dyn std::fmt::Debug| format!("{class:?}").to_uppercase();
        let measured = self.measured.map_or_else(|| "-".to_owned(), |m| class(&m));
        let Share { hits, n, lower_95, upper_95, .. } = self.accepted;
        format!("{} / {measured}, {hits} of {n} [{lower_95:.3}, {upper_95:.3}]", class(&self.required))
    }
}

/// One attack on one kind of link at one receiver.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MavlinkRow {
    /// Name of the attack.
    pub attack: Attack,
    /// The attack in a line.
    pub does: String,
    /// Kind of link.
    pub link: Link,
    /// Software of the receiver, with its version.
    pub receiver: String,
    /// Section of the published rules, and its content in short.
    pub rule: String,
    /// Messages of the attacker.
    pub attacker: Party,
    /// Messages of the true sender after the first of these.
    pub honest: Party,
    /// Messages of either that were handed on after a later datagram had arrived. Where a parser waits depends on the bytes of
    /// timestamps, and so on the time of the run.
    pub late: u64,
    /// Messages that did not provably arrive.
    pub undelivered: u64,
    /// Messages handed to the application that were no recent datagram.
    pub strays: u64,
    /// Verdict.
    pub verdict: Verdict,
    /// Reason for which an end gave no answer.
    pub fault: Option<String>,
    /// Cause of a finding, in a line, if it is known.
    pub explanation: Option<String>,
}

impl MavlinkRow {
    /// Row of a trial's counts.
    pub fn new(row: &Row, link: Link, receiver: &str, counted: Result<Counts, EndFault>) -> Self {
        let Cell { attack, honest, rule } = row.cell(link);
        let fault = counted.as_ref().err().map(ToString::to_string);
        let counts = counted.unwrap_or_default();
        let attacker = Party::new(*attack, counts.attacks_accepted, counts.attacks);
        let honest = Party::new(*honest, counts.honest_accepted, counts.honest);
        let pairs = [attacker, honest].map(|party| (party.measured, party.required));
        let verdict = judge(counts.undelivered, pairs);
        let known = (verdict == Verdict::Finding).then(|| finding::explained(row.name, link, receiver));
        Self {
            attack: row.name,
            does: row.does.clone(),
            link,
            receiver: receiver.to_owned(),
            rule: rule.clone(),
            attacker,
            honest,
            late: counts.late,
            undelivered: counts.undelivered,
            strays: counts.strays,
            verdict,
            fault,
            explanation: known.flatten(),
        }
    }
}

/// All cells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MavlinkObject {
    /// Version of the object.
    pub schema_version: u32,
    /// Seed of the attacker's chances.
    pub seed: u64,
    /// Messages of the attacker in each cell.
    pub messages: u32,
    /// True if the receivers were broken on purpose.
    pub accept_unsigned: bool,
    /// Software of the sender, with its version.
    pub sender: String,
    /// The cells.
    pub rows: Vec<MavlinkRow>,
}

/// The table for a terminal, with the findings below it.
pub fn mavlink_table(object: &MavlinkObject) -> String {
    let mut table = new_table(&["attack", "link", "receiver", "attacker", "true sender", "late", "verdict"]);
    for row in &object.rows {
        let name = row.attack.name();
        let receiver = row.receiver.clone();
        let verdict = row.verdict.name().to_owned();
        let parties = [row.attacker.describe(), row.honest.describe()];
        let [attacker, honest] = parties;
        table.add_row([name, row.link.name().to_owned(), receiver, attacker, honest, row.late.to_string(), verdict]);
    }
    let count = |verdict| object.rows.iter().filter(|row| row.verdict == verdict).count();
    let (as_published, unstated) = (count(Verdict::AsPublished), count(Verdict::Unstated));
    let (findings, invalid) = (count(Verdict::Finding), count(Verdict::Invalid));
    let mut text = format!(
        "sender {}, {} messages of the attacker in a cell, required / measured\n{table}\n\
         {} cells: {as_published} as published, {unstated} unstated, {findings} findings, {invalid} INVALID",
        object.sender,
        object.messages,
        object.rows.len()
    );
    for row in object.rows.iter().filter(|row| [Verdict::Finding, Verdict::Invalid].contains(&row.verdict)) {
        let cause = row.fault.as_deref().or(row.explanation.as_deref()).unwrap_or("not explained");
        let (name, link) = (row.attack.name(), row.link.name());
        text += &format!("\n{}: {name}, {link}, {}: {cause}", row.verdict.name(), row.receiver);
    }
    text
}
