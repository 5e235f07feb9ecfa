use super::*;

#[test]
fn the_way_does_not_depend_on_the_frame_rate() {
    let terrain = mountains();
    for (pose, held) in [
        ([3_000.0, 1_500.0, 4_500.0, 30.0, -10.0], FORWARD),
        ([3_000.0, 1_500.0, 4_500.0, 30.0, -10.0], UP),
        ([3_000.0, 1_500.0, 4_500.0, 75.0, 0.0], Held { slow: true, left: true, ..FORWARD }),
    ] {
        let flown = |frames: u32| {
            let mut flyer = standing(&terrain, pose);
            for _ in 0..frames {
                assert!(step(&mut flyer, &terrain, 1.0 / f64::from(frames), held));
            }
            eye(&flyer, &terrain)
        };
        let [start, few, many] = [terrain.camera(pose, 60.0).eye_m, flown(10), flown(100)];
        let way = start.distance(many);
        assert!(way > 100.0 && few.distance(many) < 0.01 * way, "{held:?}: {few} and {many}");
    }
}

#[test]
fn it_eases_out_and_then_rests_for_good() {
    for (terrain, [pose, _]) in worlds() {
        let mut flyer = standing(&terrain, pose);
        for _ in 0..30 {
            assert!(step(&mut flyer, &terrain, FRAME_S, FORWARD));
        }
        let released = eye(&flyer, &terrain);
        assert!(step(&mut flyer, &terrain, FRAME_S, NONE));
        assert!(eye(&flyer, &terrain).distance(released) > 0.0, "it glides on");
        let frames = (0..300).take_while(|_| step(&mut flyer, &terrain, FRAME_S, NONE)).count();
        // ln(1e6) time constants.
        assert!((60..140).contains(&frames), "{frames} frames on {}", terrain.base());
        let rested = flyer.pose();
        assert!(!step(&mut flyer, &terrain, FRAME_S, NONE));
        assert_eq!(flyer.pose(), rested);
    }
}

#[test]
fn keys_lead_where_the_camera_looks() {
    let terrain = mountains();
    let way = |yaw: f64, pitch: f64, held: Held| {
        let pose = [3_000.0, 3_000.0, 6_000.0, yaw, pitch];
        let mut flyer = standing(&terrain, pose);
        step(&mut flyer, &terrain, 0.1, held);
        assert_eq!(flyer.pose()[3..], pose[3..]);
        (eye(&flyer, &terrain) - terrain.camera(pose, 60.0).eye_m).normalize()
    };
    let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-6, "{a}, not {b}");
    near(way(90.0, 0.0, FORWARD), DVec3::X);
    near(way(0.0, -90.0, FORWARD), -DVec3::Z);
    near(
        way(0.0, 45.0, Held { forward: false, back: true, ..FORWARD }),
        DVec3::new(0.0, -0.5, -0.5).normalize(),
    );
    near(way(0.0, 60.0, Held { forward: false, right: true, ..FORWARD }), DVec3::X);
    near(way(90.0, -30.0, Held { forward: false, left: true, ..FORWARD }), DVec3::Y);
    near(way(200.0, -30.0, UP), DVec3::Z);
    near(way(200.0, 80.0, DOWN), -DVec3::Z);
}

#[test]
fn speed_grows_with_the_height_within_limits() {
    let terrain = mountains();
    let mut flyer = standing(&terrain, [3_000.0, 3_000.0, 4_000.0, 0.0, 0.0]);
    let speed = |flyer: &Flyer, above: f64| flyer.speed_m_s(Some(above));
    assert_eq!(speed(&flyer, 1_000.0), 2.0 * speed(&flyer, 500.0));
    assert_eq!(speed(&flyer, 0.0), flyer.scale.least_m);
    assert_eq!(speed(&flyer, -1e9), flyer.scale.least_m);
    assert_eq!(speed(&flyer, 1e12), flyer.scale.size_m);
    assert!((7_680.0..8_000.0).contains(&flyer.scale.size_m));
    let usual = speed(&flyer, 100.0);
    flyer.scale_speed(4.0);
    assert_eq!(speed(&flyer, 100.0), 4.0 * usual);
    flyer.scale_speed(1e30);
    assert_eq!(speed(&flyer, 100.0), 1e3 * usual);
    flyer.scale_speed(0.0);
    assert_eq!(speed(&flyer, 100.0), 1e-3 * usual);
    flyer.scale_speed(f64::NAN);
    assert_eq!(speed(&flyer, 100.0), 1e-3 * usual);
    // Beyond the border the ground last seen counts on.
    let mut flyer = standing(&terrain, [3_000.0, 7_600.0, 4_000.0, 0.0, 0.0]);
    for _ in 0..30 {
        step(&mut flyer, &terrain, FRAME_S, FORWARD);
    }
    assert_eq!(height(&flyer, &terrain), None);
    let ground = 4_000.0 - flyer.speed_m_s(None);
    let border = f64::from(terrain.ground_height_m(3_000.0, 7_680.0).unwrap());
    assert!((ground - border).abs() < 200.0, "{ground} beside {border}");
}

#[test]
fn a_cliff_is_climbed_at_any_speed() {
    let terrain = plane("procedural:cliff?size=129&amp=1000");
    for factor in [1.0, 30.0, 1e3] {
        let mut flyer = standing(&terrain, [1_500.0, 1_900.0, 40.0, 90.0, -5.0]);
        flyer.scale_speed(factor);
        let mut on_top = false;
        for _ in 0..600 {
            step(&mut flyer, &terrain, 0.1, FAST);
            let Some(above_m) = height(&flyer, &terrain) else { break };
            assert!(above_m >= 0.999 * flyer.scale.clearance_m, "{above_m} m at {:?}", flyer.pose());
            on_top |= flyer.pose()[2] > 1_000.0;
        }
        assert!(on_top, "times {factor}: {:?}", flyer.pose());
    }
}

#[test]
fn no_surface_is_dived_into() {
    for (terrain, [pose, _]) in worlds() {
        let mut flyer = standing(&terrain, [pose[0], pose[1], pose[2], 20.0, -70.0]);
        flyer.scale_speed(5.0);
        for _ in 0..120 {
            step(&mut flyer, &terrain, FRAME_S, FAST);
            let Some(above_m) = height(&flyer, &terrain) else { break };
            assert!(above_m >= 0.999 * flyer.scale.clearance_m, "{above_m} m on {}", terrain.base());
        }
        // Where up leads nowhere it stays.
        flyer.set_pose([pose[0], pose[1], pose[2], 0.0, 0.0]);
        let buried = |_: DVec3| Some(-100.0);
        flyer.step(FRAME_S, &NONE, &terrain, &Ground { above: &buried });
        assert_eq!(flyer.pose(), [pose[0], pose[1], pose[2], 0.0, 0.0]);
    }
    // Buried, it comes up without a key.
    let terrain = mountains();
    let mut flyer = standing(&terrain, [3_000.0, 3_000.0, -500.0, 0.0, 0.0]);
    assert!(step(&mut flyer, &terrain, 0.0, NONE));
    assert!((height(&flyer, &terrain).unwrap() - flyer.scale.clearance_m).abs() < 1e-6);
}

/// Rock from 100 to 150 m over a floor at 0.
#[test]
fn a_roof_is_not_passed_through() {
    let terrain = mountains();
    let rock = |p: DVec3| {
        Some(match p.z {
            z if z < 100.0 => z.min(100.0 - z),
            z if z < 150.0 => -(z - 100.0).min(150.0 - z),
            z => z - 150.0,
        })
    };
    let ground = Ground { above: &rock };
    let mut flyer = standing(&terrain, [3_000.0, 3_000.0, 50.0, 0.0, 0.0]);
    let least_m = 0.999 * flyer.scale.clearance_m;
    for _ in 0..300 {
        flyer.step(FRAME_S, &UP, &terrain, &ground);
        assert!(flyer.pose()[2] <= 100.0 - least_m, "{:?}", flyer.pose());
    }
    let highest = flyer.pose()[2];
    for _ in 0..180 {
        flyer.step(FRAME_S, &DOWN, &terrain, &ground);
        assert!(flyer.pose()[2] >= least_m);
    }
    assert!(flyer.pose()[2] < highest - 10.0, "it does not stick: {:?}", flyer.pose());
}

#[test]
fn following_keeps_the_height_above_mountains() {
    let terrain = mountains();
    let at = [1_000.0, 1_000.0, 5_000.0, 40.0, -35.0];
    for (held, frames, most) in [(FORWARD, 1_200, 3.0), (FAST, 200, 8.0)] {
        let mut flyer = standing(&terrain, at);
        let ground_m = 5_000.0 - height(&flyer, &terrain).unwrap();
        flyer.set_pose([at[0], at[1], ground_m + 150.0, at[3], at[4]]);
        flyer.set_following(true, Some(150.0));
        assert!(flyer.is_following());
        let start = eye(&flyer, &terrain);
        for _ in 0..frames {
            step(&mut flyer, &terrain, FRAME_S, held);
            let above_m = height(&flyer, &terrain).unwrap();
            let range = 0.999 * flyer.scale.clearance_m..=most * 150.0;
            assert!(range.contains(&above_m), "{above_m} m at {:?}", flyer.pose());
        }
        // Level over the ground at full speed, although the camera looks down.
        let way = (eye(&flyer, &terrain) - start).truncate().length();
        let expected = 150.0 * f64::from(frames) * FRAME_S * if held.fast { 8.0 } else { 1.0 };
        assert!(way > 0.9 * expected && way < 1.001 * expected, "{way} m of {expected} m");
        assert!(rests(&mut flyer, &terrain));
        assert!((height(&flyer, &terrain).unwrap() - 150.0).abs() < 1e-3);
        flyer.set_following(false, None);
        assert!(!flyer.is_following());
    }
}

#[test]
fn following_takes_the_height_it_finds_and_keys_change_it() {
    let terrain = mountains();
    let mut flyer = standing(&terrain, [3_000.0, 3_000.0, 4_000.0, 0.0, 0.0]);
    let found = height(&flyer, &terrain).unwrap();
    flyer.set_following(true, None);
    assert!(!step(&mut flyer, &terrain, FRAME_S, NONE), "it is where it shall be");
    assert_eq!(height(&flyer, &terrain), Some(found));
    for _ in 0..60 {
        step(&mut flyer, &terrain, FRAME_S, UP);
    }
    assert!(rests(&mut flyer, &terrain) && height(&flyer, &terrain).unwrap() > 2.0 * found);
    for _ in 0..900 {
        step(&mut flyer, &terrain, FRAME_S, Held { fast: true, ..DOWN });
    }
    let lowest = height(&flyer, &terrain).unwrap();
    assert!((lowest / flyer.scale.clearance_m - 1.0).abs() < 1e-3, "{lowest} m");
    // A camera that is set elsewhere keeps the height it has there.
    flyer.set_pose([4_000.0, 3_000.0, 5_000.0, 0.0, 0.0]);
    assert!(!step(&mut flyer, &terrain, FRAME_S, NONE));
    assert_eq!(flyer.pose()[2], 5_000.0);
}

#[test]
fn nothing_turns_over_at_the_pole() {
    let terrain = globe();
    let mut flyer = standing(&terrain, [10.0, 88.0, 2e5, 0.0, 0.0]);
    let mut before = flyer.camera(&terrain, 60.0);
    let mut nearest = f64::INFINITY;
    for _ in 0..180 {
        step(&mut flyer, &terrain, FRAME_S, FORWARD);
        let now = flyer.camera(&terrain, 60.0);
        assert!(degrees_between(&before, &now) < 0.1, "at {:?}", flyer.pose());
        let [a, b] = [&before, &now].map(|c| c.right_and_up()[0]);
        assert!(a.dot(b) > 0.999_99, "at {:?}", flyer.pose());
        nearest = nearest.min(now.eye_m.truncate().length());
        before = now;
    }
    let [x, y, z, yaw, pitch] = flyer.pose();
    assert!(nearest < 5e3 && y < 88.5, "it did not pass over: {:?}", flyer.pose());
    let off = |angle: f64| (angle + 180.0).rem_euclid(360.0) - 180.0;
    assert!(off(x + 170.0).abs() < 1e-6 && off(yaw - 180.0).abs() < 1e-6, "{:?}", flyer.pose());
    assert!((z - 2e5).abs() < 1e-3 && pitch == 0.0);
}

#[test]
fn the_middle_of_a_tunnel_is_flown_through() {
    let terrain = tunnel();
    let mut flyer = standing(&terrain, [500.0, 1_000.0, 1_900.0, 90.0, 75.0]);
    let mut before = flyer.camera(&terrain, 60.0);
    let start = before;
    let mut straight_m = 0.0_f64;
    for _ in 0..60 {
        step(&mut flyer, &terrain, FRAME_S, FORWARD);
        let now = flyer.camera(&terrain, 60.0);
        assert!(now.eye_m.distance(before.eye_m) < 60.0, "it leaps to {:?}", flyer.pose());
        let way = now.eye_m - start.eye_m;
        if way.normalize_or_zero().dot(start.forward()) > 0.999 {
            straight_m = straight_m.max(way.length());
        }
        before = now;
    }
    // Past the middle, which is 100 m away; beyond that it flies over the other side's ground, which bends.
    assert!(straight_m > 250.0, "{straight_m} m");
}
