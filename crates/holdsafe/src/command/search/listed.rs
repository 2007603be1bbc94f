//! Sequences that are known before the first is tried: of `--exhaust`, and of strategies that do not learn. Each is tried and kept by its number,
//! so they come in partitions and resume.

use std::path::Path;
use std::rc::Rc;

use evidence::trial::Outcome;
use parallel::progress::Progress;
use results::campaign::InputDigest;
use runner::failure::{Exit, Failure};
use runner::lines::LineFault;
use runner::numbered::{Check, Numbered};
use runner::search_config::{MOST_SEQUENCES, unfit};
use runner::{Context, plan};
use scenario::AttackSpace;
use search::{AttackSequence, Counted, Moments, ROUND, RunResult, SearchConfig, Strategy, ends_in};
use serde::Serialize;

use super::Args;

/// The sequences, in order.
pub(super) struct Listed {
    pub(super) sequences: Vec<AttackSequence>,
    /// The result before any of them.
    begun: RunResult,
}

/// Everything that the result of a sequence depends on.
#[derive(Serialize)]
struct Terms<'a> {
    /// SHA-256 over the sources of the program.
    program: &'a str,
    content: InputDigest,
    space: &'a AttackSpace,
    seed: u64,
    find: &'a [Outcome],
    exhaust: Option<u32>,
    strategy: Strategy,
    draws: u64,
    budget: u64,
}

/// Refusal of a strategy whose sequences are not known beforehand.
pub(super) fn learns() -> Failure {
    let message = "each sequence of a strategy that learns depends on the results of earlier ones; partitions take --strategy uniform or \
                   transitions, or --exhaust K";
    Failure::new(Exit::Usage, message)
}

impl Listed {
    /// Lists of a command line; `None` for a strategy that learns.
    pub(super) fn from_args(args: &Args, config: &SearchConfig) -> Result<Option<Self>, Failure> {
        if let Some(longest) = args.exhaust {
            let sequences = exhaustive(config, longest as usize)?;
            return Ok(Some(Self { sequences, begun: RunResult::default() }));
        }
        if args.strategy.learns() {
            return Ok(None);
        }
        if args.budget > MOST_SEQUENCES as u64 {
            let message = format!("{} trials in partitions, at most {MOST_SEQUENCES} are taken", args.budget);
            return Err(Failure::new(Exit::Usage, message));
        }
        let listed = config.listed(args.run()).map_err(unfit)?;
        Ok(listed.map(|(sequences, begun)| Self { sequences, begun }))
    }

    /// Tries this partition's sequences that are not in `dir` yet; returns all results in `dir`.
    pub(super) fn try_missing(
        &self,
        context: &Context,
        args: &Args,
        config: &SearchConfig,
        dir: &Path,
    ) -> Result<Numbered<Counted>, Failure> {
        let (terms, total) = (Terms::new(context, args, config)?, self.sequences.len() as u64);
        let mut numbered = Numbered::open(dir, &terms, total, check(&args.find), &context.stop)?;
        args.from.iter().try_for_each(|from| numbered.add(from))?;
        let is_mine = |number: &u64| args.partition.is_none_or(|partition| partition.holds(*number));
        let missing: Vec<u64> = (0..total).filter(|number| is_mine(number) && !numbered.is_finished(*number)).collect();
        let progress = Progress::new("search", missing.len(), context.talk);
        for round in missing.chunks(ROUND as usize) {
            let sequences: Vec<AttackSequence> = round.iter().map(|n| self.sequences[*n as usize].clone()).collect();
            let tried = config.try_each(&sequences, &ends_in(&args.find), args.threads(), &progress, &context.stop);
            let tried = tried.map_err(|reason| match context.stop.is_requested() {
                true => {
                    Failure::new(Exit::Interrupted, format!("stopped; what was tried is kept in {}", dir.display()))
                }
                false => unfit(reason),
            })?;
            round.iter().zip(tried).try_for_each(|(number, one)| numbered.put(*number, one))?;
        }
        progress.finish();
        Ok(numbered)
    }

    /// The result of all of them. A finding that was kept is tried again: it has to come out so here too.
    pub(super) fn result(
        self,
        numbered: &Numbered<Counted>,
        args: &Args,
        config: &SearchConfig,
    ) -> Result<RunResult, Failure> {
        let mut result = self.begun;
        for (number, sequence) in (0..).zip(&self.sequences) {
            if let Some(counted) = numbered.get(number)? {
                result.take(sequence, &counted);
            }
        }
        for (cause, found) in &result.found {
            let repeated = ends_in(&args.find)(&config.try_sequence(&found.sequence).map_err(unfit)?);
            if repeated.as_ref() != Some(cause) {
                let message = format!("sequence {} was kept as a finding and is none; remove its folder", found.trial);
                return Err(Failure::new(Exit::Unexpected, message));
            }
        }
        Ok(result)
    }
}

impl<'a> Terms<'a> {
    fn new(context: &'a Context, args: &'a Args, config: &'a SearchConfig) -> Result<Self, Failure> {
        Ok(Self {
            program: context.program,
            content: plan::content(&config.scenario, &config.setup)?,
            space: &config.space,
            seed: config.seed,
            find: &args.find,
            exhaust: args.exhaust,
            strategy: args.strategy,
            draws: args.draws,
            budget: args.budget,
        })
    }
}

/// A sequence has a cause exactly if its class was looked for.
fn check(find: &[Outcome]) -> Check<Counted> {
    let find = find.to_vec();
    Rc::new(move |one: &Counted| {
        let class = one.cause.as_ref().map(|cause| cause.outcome);
        let sought = find.contains(&one.outcome).then_some(one.outcome);
        if class == sought {
            Ok(())
        } else {
            Err(LineFault::Content("a cause that is not that of its class".to_owned()))
        }
    })
}

/// Every sequence of up to a given number of actions over the small part of the attack space.
fn exhaustive(config: &SearchConfig, longest: usize) -> Result<Vec<AttackSequence>, Failure> {
    let nominal = config.try_sequence(&AttackSequence::default()).map_err(unfit)?;
    let moments = Moments::from_run(&nominal, &config.space, &config.setup.bounds);
    // The longest are the most: their number is checked before any are made.
    let mut sequences = Vec::new();
    for k in (1..=longest).rev() {
        let too_many = || {
            let message = format!("more than {MOST_SEQUENCES} sequences of {k} actions; exhaust fewer actions");
            Failure::new(Exit::Usage, message)
        };
        sequences.push(config.sequences(k, &moments, MOST_SEQUENCES).ok_or_else(too_many)?);
    }
    Ok(sequences.into_iter().rev().flatten().collect())
}
