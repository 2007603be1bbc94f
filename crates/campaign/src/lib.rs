//! The instrument: scenarios in, judged trials out.
//!
//! `catalogue` lists the threats, `scenario` reads what is to happen, `campaign` plans many trials of it, `cast` decides who takes part, `twin` and `live` carry
//! it out with the same cores, `stack` on the real DTLS and TLS libraries in memory; `oracle` judges, `report` and `stats`
//! put numbers on many trials, `ablation` on what a check is worth, `explain` says why a mode changed, `story` tells one run, `refeed` feeds its cores again, `diff` sets two side by side, `leak` what an observer sees of the links, `search` looks for what nobody wrote down, `rare` at what almost never happens, `command` is the `holdsafe` program. How a service
//! decides is none of its business.

pub mod command;
