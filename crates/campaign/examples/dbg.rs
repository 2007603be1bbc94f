//! scratch
use wire::core::{Input, Topic};
fn main() {
    let root = std::env::current_dir().unwrap();
    let a: Vec<String> = std::env::args().collect();
    let s = campaign::scenario::load(&root.join(format!("scenarios/{}.toml", a[1]))).unwrap();
    let v = s.variations(None).remove(0).scenario;
    let setup = campaign::scenario::Setup::load(&root, &v, None, a.get(3).is_some()).unwrap();
    let (cast, mut twin) = campaign::twin::trial::start(&v, &setup, a[2].parse().unwrap(), true).unwrap();
    twin.run_until(cast.duration);
    for (m, mouth) in cast.members.iter().zip(twin.mouths().unwrap()) {
        if m.node().name() != "unit-a" { continue; }
        for f in mouth {
            if let Input::Bus { topic: Topic::Tracks, bytes } = &f.input {
                let body = &bytes[22..bytes.len() - 16];
                let t: wire::track::Tracks = minicbor::decode(body).unwrap();
                println!("{} {:?}", t.frame.0, t.tracks.iter().map(|t| (t.id.0, t.class, t.x_mm, t.y_mm, t.confidence, t.supported.0, t.vetoed.0, t.frame.0)).collect::<Vec<_>>());
            }
        }
    }
}
