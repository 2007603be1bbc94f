//! Looking at a rate as often as one likes: e-values that bound the probability of ever being wrong.
//!
//! The odds of a hit, weighed c to 1 against a rate p, have the likelihood ratio c^hits / (1 + (c - 1) p)^n. One factor has the
//! mean (1 + (c - 1) q) / (1 + (c - 1) p) under a true rate q: at most 1 where c < 1 and q >= p, and where c > 1 and q <= p. A
//! mixture over several c is therefore a test supermartingale, and by Ville's inequality it ever reaches 1 / alpha with a
//! probability of at most alpha, for any number and times of looks.
//!
//! J. Ville, Étude critique de la notion de collectif, 1939. H. Robbins, Statistical methods related to the law of the
//! iterated logarithm, Annals of Mathematical Statistics 41, 1970 (mixtures). A. Ramdas, P. Grünwald, V. Vovk, G. Shafer,
//! Game-theoretic statistics and safe anytime-valid inference, Statistical Science 38, 2023.

use super::bisect;

/// Bets against "the rate is at least p": odds of a hit, and the share of the mixture. Half of it bets on no hit at
/// all: a claim without a hit takes ln(2 / alpha) / p trials, where the fixed number is ln(1 / alpha) / p.
const BELOW: [(f64, f64); 4] = [(0.0, 0.5), (0.25, 1.0 / 6.0), (0.5, 1.0 / 6.0), (0.75, 1.0 / 6.0)];
/// Bets against "the rate is at most p".
const ABOVE: [(f64, f64); 4] = [(1.5, 0.25), (2.0, 0.25), (4.0, 0.25), (16.0, 0.25)];

/// Evidence against a rate of at least `p` after `hits` of `n`: an e-value, 1 before the first trial.
pub fn evidence_below(hits: u64, n: u64, p: f64) -> f64 {
    BELOW.iter().map(|bet| wealth(*bet, hits, n, p)).sum()
}

/// Evidence against a rate of at most `p`.
pub fn evidence_above(hits: u64, n: u64, p: f64) -> f64 {
    ABOVE.iter().map(|bet| wealth(*bet, hits, n, p)).sum()
}

/// Upper bound on the rate that holds at all looks jointly with a probability of at least 1 - `alpha`.
pub fn upper(hits: u64, n: u64, alpha: f64) -> f64 {
    bisect(0.0, 1.0, |p| evidence_below(hits, n, p) < alpha.recip())
}

/// Lower bound of the same kind.
pub fn lower(hits: u64, n: u64, alpha: f64) -> f64 {
    // Evidence falls as p rises: with too little at 0 there is no crossing to bisect.
    if evidence_above(hits, n, 0.0) < alpha.recip() {
        return 0.0;
    }
    bisect(0.0, 1.0, |p| evidence_above(hits, n, p) >= alpha.recip())
}

fn wealth((odds, weight): (f64, f64), hits: u64, n: u64, p: f64) -> f64 {
    // Odds of 0 have the logarithm minus infinity, and 0 times that is NaN.
    let won = if hits == 0 { 0.0 } else { hits as f64 * libm::log(odds) };
    weight * libm::exp(won - n as f64 * libm::log1p((odds - 1.0) * p))
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{RngCore, SeedableRng};

    use super::super::{rate_lower, rate_upper};
    use super::*;

    const RATE: f64 = 0.05;
    const ALPHA: f64 = 0.05;
    const RUNS: u64 = 4_000;

    /// Number of seeded series of trials at exactly `RATE` in which some look reached `1 / alpha`. There is a look
    /// every 50 of 2,000 trials.
    fn ever_wrong(evidence: fn(u64, u64, f64) -> f64, alpha: f64) -> u64 {
        let wrong = |run: &u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(*run);
            let mut hits = 0;
            (1..=2_000u64).any(|n| {
                hits += u64::from((rng.next_u64() >> 11) as f64 * 2f64.powi(-53) < RATE);
                n.is_multiple_of(50) && evidence(hits, n, RATE) >= alpha.recip()
            })
        };
        (0..RUNS).filter(wrong).count() as u64
    }

    #[test]
    fn claims_at_the_very_rate_stay_within_alpha() {
        for evidence in [evidence_below, evidence_above] {
            let wrong = ever_wrong(evidence, ALPHA);
            assert!(rate_upper(wrong, RUNS, 0.999) <= ALPHA, "{wrong} of {RUNS} series claim what is not so");
            assert!(wrong > 0, "a test that never errs says nothing");
        }
    }

    #[test]
    fn low_threshold_shows_in_the_same_series() {
        for evidence in [evidence_below, evidence_above] {
            let wrong = ever_wrong(evidence, 5.0 * ALPHA);
            assert!(rate_lower(wrong, RUNS, 0.999) > ALPHA, "{wrong} of {RUNS} series");
        }
    }

    #[test]
    #[ignore = "long: many campaigns"]
    fn fixed_number_bound_fails_under_many_looks() {
        fn fixed(hits: u64, n: u64, p: f64) -> f64 {
            if rate_upper(hits, n, 1.0 - ALPHA) < p { ALPHA.recip() } else { 0.0 }
        }
        assert!(rate_lower(ever_wrong(fixed, ALPHA), RUNS, 0.999) > ALPHA);
    }

    #[test]
    fn claim_without_hits_takes_a_quarter_more() {
        let first = (1..).find(|n| evidence_below(0, *n, 0.01) >= 20.0);
        assert!(first.is_some_and(|n| (300..=368).contains(&n)), "{first:?}");
    }

    #[test]
    fn bounds_are_the_rates_of_sufficient_evidence() {
        let (low, high) = (lower(30, 1_000, ALPHA), upper(30, 1_000, ALPHA));
        assert!(low < 0.03 && 0.03 < high && high < 0.06, "{low} {high}");
        assert!((evidence_below(30, 1_000, high) * ALPHA - 1.0).abs() < 1e-6);
        assert!((evidence_above(30, 1_000, low) * ALPHA - 1.0).abs() < 1e-6);
        assert_eq!((lower(0, 100, ALPHA), upper(100, 100, ALPHA)), (0.0, 1.0));
        assert!(upper(0, 0, ALPHA) >= 1.0 - 1e-9);
    }
}
