//! From a scenario's tables to an admitted teammate's statements in bad faith.

use adversary::plan::{Confusion, Falsehood, InsiderTeammateConfig, Motion, Product, Resend};
use scenario::Scenario;

use super::start::start_ms;

/// Adds it to the insider's plan.
pub(super) fn plan(s: &Scenario, phase: u64, config: &mut InsiderTeammateConfig) {
    config.resend = s.session_replay.first().map(|r| Resend {
        at_ms: start_ms(r, phase),
        count: r.count.unsigned() as u32,
        every_ms: r.every_ms.unsigned(),
        restart: r.restart,
    });
    let falsehood = |f: &scenario::Falsehood| Falsehood {
        at_ms: start_ms(f, phase),
        duration_ms: (f.duration_s.get() * 1000.0) as u64,
        drift_mm_s: (f.drift_m_s.get() * 1000.0) as u32,
        towards_mrad: (f.towards_rad.get() * 1000.0) as i32,
        motion: match f.motion {
            scenario::Motion::Hidden => Motion::Hidden,
            scenario::Motion::Owned => Motion::Owned,
            scenario::Motion::Feigned => Motion::Feigned,
        },
    };
    config.falsehoods = s.falsehood.iter().map(falsehood).collect();
    let confusion = |c: &scenario::ModeConfusion| Confusion {
        at_ms: start_ms(c, phase),
        duration_ms: (c.duration_s.get() * 1000.0) as u64,
        product: match c.product {
            scenario::Product::Live => Product::Live,
            scenario::Product::Synthetic => Product::Synthetic,
            scenario::Product::Replayed => Product::Replayed,
        },
        clock_ms: c.clock_ms.get(),
    };
    config.confusions = s.mode_confusion.iter().map(confusion).collect();
}
