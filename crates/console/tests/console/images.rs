//! Images of tracks: which crops are shown, and what an operator with an eye makes of them.

use console::eye::Eye;
use console::operator::{Action, TrackCondition};
use wire::command::CommandKind;
use wire::crop::{HEIGHT, Pictured, WIDTH};
use wire::feed::Feed;
use wire::id::{Boot, TrackId, UnitId};
use wire::mode::Mode;
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::report::{Report, ReportedTrack};
use wire::sensor::Class;
use wire::time::Span;

use crate::bench::{Bench, crops_of, report, step};

/// Encoded crops of track 4 in one shade, and the entry that vouches for them.
fn crops(shade: u8) -> (Vec<Vec<u8>>, Pictured) {
    crops_of(TrackId(4), shade)
}

impl Bench {
    fn crop(&mut self, bytes: &[u8]) {
        self.feed(&Feed::Crop(UnitId::A, bytes.into()));
    }

    fn vouch(&mut self, pictured: Option<Pictured>) {
        self.pass(Span::ms(100));
        let report = Report { pictured, ..self.next(Mode::Ready) };
        self.heard(&report, Span::ms(20));
    }

    /// The first byte of the image in warmth, and its age.
    fn image(&self) -> Option<(u8, Span)> {
        let shown = self.console.shown(self.now);
        let images = shown.unit(UnitId::A)?.images.first()?;
        let warmth = images.get().0.sights[1].image.as_ref()?;
        assert_eq!((warmth.width, warmth.height), (WIDTH, HEIGHT));
        Some((warmth.rgb[0], images.age()))
    }
}

#[test]
fn crops_are_shown_once_a_report_vouches_for_them() {
    let mut bench = Bench::new(Policy::default(), Vec::new());
    let ((first, vouched), (forged, _)) = (crops(40), crops(90));
    first.iter().chain(&forged).for_each(|bytes| bench.crop(bytes));
    bench.vouch(None);
    assert_eq!(bench.image(), None);
    bench.vouch(Some(vouched.clone()));
    let (shade, age) = bench.image().expect("its report names it");
    assert_eq!(shade, 40, "and never the forged one");
    assert!(age >= Span::ms(150), "as old as the unit says, and the report: {age}");
    bench.vouch(Some(Pictured { age: Span::ms(230), ..vouched }));
    assert!(bench.image().expect("still shown").1 >= Span::ms(250));
    bench.vouch(Some(crops(70).1));
    assert_eq!(bench.image().map(|(shade, _)| shade), Some(40), "those of the new report have not come");
    bench.pass(Span::ms(100));
    let report = Report { tracks: Default::default(), ..bench.next(Mode::Ready) };
    bench.heard(&report, Span::ms(20));
    assert_eq!(bench.image(), None, "its track is gone");
}

/// A unit that has started again may give the number to another object.
#[test]
fn images_end_with_the_boot_and_with_their_age() {
    let mut bench = Bench::new(Policy::default(), Vec::new());
    let (bytes, vouched) = crops(40);
    let show = |bench: &mut Bench| {
        bytes.iter().for_each(|bytes| bench.crop(bytes));
        bench.vouch(Some(vouched.clone()));
        assert!(bench.image().is_some());
    };
    show(&mut bench);
    bench.reports(Mode::Ready, Span::ms(1_500));
    assert!(bench.image().is_some());
    bench.reports(Mode::Ready, Span::ms(600));
    assert_eq!(bench.image(), None, "as old as a unit that is lost");
    show(&mut bench);
    bench.pass(Span::ms(100));
    let repeated = Report { boot: Boot(2), ..bench.next(Mode::Idle) };
    bench.heard(&repeated, Span::ms(20));
    assert_eq!(bench.image(), None, "of an earlier boot");
}

#[test]
fn crops_of_two_tracks_never_stand_for_one() {
    let mut bench = Bench::new(Policy::default(), Vec::new());
    let (bytes, vouched) = crops(40);
    bytes.iter().for_each(|bytes| bench.crop(bytes));
    bench.vouch(Some(Pictured { track: TrackId(5), ..vouched }));
    assert_eq!(bench.image(), None);
    bench.crop(&bytes[0][1..]);
    bench.feed(&Feed::Crop(UnitId::C, bytes[0].as_slice().into()));
    assert_eq!(bench.refusals(), [Reason::Schema, Reason::Unit]);
}

/// The bench's track is no vehicle, and all of twelve cycles across; scaled down by two it is six.
#[test]
fn operator_with_an_eye_arms_no_fake() {
    let mut arm = step(100, Action::Arm(Class::Vehicle), Mode::Ready);
    arm.when.track = Some(TrackCondition { class: Class::Vehicle, confidence: 800 });
    let armed = |eye: Option<Eye>, images: bool| {
        let mut bench = Bench::with_eye(vec![arm.clone()], eye);
        let (bytes, vouched) = crops(40);
        if images {
            bytes.iter().for_each(|bytes| bench.crop(bytes));
            bench.vouch(Some(vouched));
        }
        bench.reports(Mode::Ready, Span::ms(500));
        bench.intents().first().map(|(intent, _)| intent.kind)
    };
    let eye = |better_ppm, vehicles| Some(Eye { cycles_milli: 6400, better_ppm, vehicles });
    let orders = Some(CommandKind::Arm(TrackId(4)));
    assert_eq!(armed(None, false), orders, "goes by the machine");
    assert_eq!(armed(eye(700_000, Vec::new()), false), None);
    assert_eq!(armed(eye(990_000, Vec::new()), false), orders, "an observer who cannot tell");
    assert_eq!(armed(eye(700_000, Vec::new()), true), orders, "too little to see in a smaller image");
    assert_eq!(armed(eye(0, vec![(10_000, 500)]), false), orders, "a vehicle is there");
}

/// Track 4 of the bench's report, so wide and there.
fn track(x_mm: i32, across_px: u16) -> ReportedTrack {
    let report = report(1, 1, Mode::Ready);
    ReportedTrack { x_mm, across_px, ..report.tracks[0] }
}

/// Shares of observers by the ACQUIRE model, computed apart.
#[test]
fn johnsons_cycles_decide_who_identifies() {
    let share = |across_px: u16| {
        let differs = |better_ppm: &u32| {
            let eye = Eye { cycles_milli: 6400, better_ppm: *better_ppm, vehicles: Vec::new() };
            eye.sees_through(&track(0, across_px), 1)
        };
        (0..1_000_000).step_by(1000).filter(differs).count()
    };
    assert_eq!(share(0), 0);
    assert_eq!(share(6), 92, "0.46875 to the power of 3.028 is 0.1008, a share of 0.0916");
    assert_eq!(share(16), 690, "1.25 to the power of 3.575 is 2.2206, a share of 0.6895");
    assert_eq!(share(200), 1000);
}

#[test]
fn true_vehicles_are_never_seen_through() {
    let vehicles = vec![(0, 1000), (10_000, -900), (11_000, -900)];
    let eye = Eye { cycles_milli: 6400, better_ppm: 0, vehicles };
    let sees = |x_mm: i32| eye.sees_through(&track(x_mm, 60), 1);
    let places = [0, 1_000, 1_200, 8_000, 9_000, 10_500, 12_000, 13_000];
    assert_eq!(places.map(sees), [false, false, true, true, false, false, false, true]);
}
