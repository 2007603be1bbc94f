//! Sensors and localisation that fail or lie.

use holdsafe_tests::shipped;

use crate::SEEDS;

#[test]
fn loss_of_the_thermal_camera_degrades_and_revokes_authority() {
    for run in shipped("thermal_loss").expect(SEEDS) {
        assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn loss_of_the_colour_camera_degrades_and_revokes_authority() {
    for run in shipped("rgb_loss").expect(SEEDS) {
        assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn starved_tracks_degrade() {
    shipped("track_starvation").expect(SEEDS);
}

#[test]
fn loss_of_localisation_holds() {
    shipped("localisation_loss").expect(SEEDS);
}
