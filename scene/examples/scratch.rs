use scene::*;
use std::time::Instant;
fn main() {
    for area in [17.0, 41.5, 68.8] {
        for seed in 0..10 {
            let t = Instant::now();
            let walls = if area < 20.0 {
                3
            } else if area < 50.0 {
                6
            } else {
                9
            };
            let o = GenerateOptions {
                seed,
                area_m2: area,
                walls,
                ..Default::default()
            };
            match generate(&o) {
                Ok(g) => println!(
                    "{area} {seed} ok {:?} {:?} exact {} pitch {} {}x{}",
                    t.elapsed(),
                    g.scene.bounds.1,
                    g.scene.lattice.exact,
                    g.scene.lattice.pitch_m,
                    g.scene.lattice.width,
                    g.scene.lattice.height
                ),
                Err(e) => println!("{area} {seed} {e} {:?}", t.elapsed()),
            }
        }
    }
    let g = generate(&GenerateOptions {
        area_m2: 68.8,
        walls: 8,
        seed: 1,
        ..Default::default()
    })
    .unwrap();
    let s = &g.scene;
    let mut occ = Occupancy::new(s);
    let n = 10000;
    let t = Instant::now();
    for _ in 0..n {
        occ.reset(s, s.objects[0].class);
    }
    println!("reset {:?}", t.elapsed() / n);
    let t = Instant::now();
    for _ in 0..n {
        occ.reset(s, s.objects[0].class);
        for o in &s.objects {
            occ.block(s, &o.shape, o.start, true);
            occ.block(s, &o.shape, o.goal.unwrap(), true);
        }
    }
    println!("reset+10 block compound {:?}", t.elapsed() / n);
    let t = Instant::now();
    for _ in 0..n {
        occ.reset(s, ROBOT_ALONE);
        for o in &s.objects {
            occ.block_swept(s, &s.robot.shape, o.start, o.start + Vec2::new(0.3, 0.2));
        }
    }
    println!("reset+5 swept robot {:?}", t.elapsed() / n);
    occ.reset(s, ROBOT_ALONE);
    let mut f = Flood::new(s);
    let t = Instant::now();
    for _ in 0..100 {
        f.run(s, &occ, s.homes[0]);
    }
    println!(
        "flood {:?} of {} points",
        t.elapsed() / 100,
        s.lattice.len()
    );
    let (a, b) = (&s.robot.shape, &s.objects[0].shape);
    let t = Instant::now();
    let mut c = 0u32;
    for i in 0..10_000_000u32 {
        c += u32::from(overlap(
            a,
            Vec2::new(f64::from(i % 97) * 0.01, 0.1),
            b,
            Vec2::zeros(),
        ));
    }
    println!("overlap box {:?} {c}", t.elapsed() / 10_000_000);
    let t = Instant::now();
    for i in 0..10_000_000u32 {
        c += u32::from(swept_overlap(
            a,
            Vec2::new(f64::from(i % 97) * 0.01, 0.1),
            Vec2::new(0.2, 0.3),
            b,
            Vec2::zeros(),
        ));
    }
    println!("swept box {:?} {c}", t.elapsed() / 10_000_000);
    let a = Shape::circle(0.25).unwrap();
    let t = Instant::now();
    for i in 0..1_000_000u32 {
        c += u32::from(swept_overlap(
            &a,
            Vec2::new(f64::from(i % 97) * 0.01, 0.1),
            Vec2::new(0.2, 0.3),
            b,
            Vec2::zeros(),
        ));
    }
    println!("swept circle {:?} {c}", t.elapsed() / 1_000_000);
    let mut d = Draft::room("big", [0.0, 0.0, 100.0, 100.0]);
    d.homes = vec![[0.5, 0.5]];
    for i in 0..1000 {
        let (x, y) = (f64::from(i % 40) * 2.0 + 5.0, f64::from(i / 40) * 2.0 + 5.0);
        d.objects
            .push(ObjectDraft::paper([x, y], Some([x + 1.0, y])));
        d.walls.push(WallDraft::Box([x - 0.5, y, x - 0.4, y + 0.4]));
    }
    let t = Instant::now();
    let s = Scene::new(d).unwrap();
    println!(
        "big scene {:?} {} points, exact {}",
        t.elapsed(),
        s.lattice.len(),
        s.lattice.exact
    );
}
