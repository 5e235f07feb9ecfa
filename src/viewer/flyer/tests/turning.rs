use super::*;

/// Nothing to run into.
const NO_GROUND: Ground<'static> = Ground { above: &|_| None };

#[test]
fn the_mouse_turns_in_proportion_to_the_field_of_view() {
    let terrain = mountains();
    let mut flyer = standing(&terrain, [3_000.0, 3_000.0, 4_000.0, 10.0, 0.0]);
    flyer.look([200.0, 100.0], 60.0);
    assert_eq!(flyer.pose(), [3_000.0, 3_000.0, 4_000.0, 30.0, -10.0]);
    flyer.look([-200.0, -100.0], 30.0);
    assert_eq!(flyer.pose()[3..], [20.0, -5.0]);
    flyer.look([0.0, 1e6], 60.0);
    assert_eq!(flyer.pose()[4], -90.0);
    flyer.look([0.0, -1e6], 60.0);
    assert_eq!(flyer.pose()[4], 90.0);
    flyer.look([36_000.0, 0.0], 60.0);
    assert!((flyer.pose()[3] - 20.0).abs() < 1e-9, "ten turns lead back");
    flyer.look([f64::NAN, 0.0], 60.0);
    assert!((flyer.pose()[3] - 20.0).abs() < 1e-9);
}

#[test]
fn poses_are_kept_as_they_are_given() {
    for (terrain, poses) in worlds() {
        let mut flyer = Flyer::new(&terrain, &terrain.overview(60.0));
        assert!(flyer.camera(&terrain, 60.0).validate().is_ok());
        for pose in poses {
            flyer.set_pose([pose[0], pose[1], pose[2], 270.0, pose[4]]);
            assert_eq!(flyer.pose(), [pose[0], pose[1], pose[2], 270.0, pose[4]]);
            assert_eq!(flyer.camera(&terrain, 40.0), terrain.camera(flyer.pose(), 40.0));
            assert!(!step(&mut flyer, &terrain, FRAME_S, NONE));
            assert_eq!(flyer.pose()[3], 270.0);
        }
    }
}

#[test]
fn flights_end_exactly_at_their_goal() {
    for (terrain, [start, goal]) in worlds() {
        let mut flyer = standing(&terrain, start);
        flyer.fly_to(&terrain, goal);
        assert!(flyer.is_moving() && flyer.pose() == start);
        let mut before = flyer.camera(&terrain, 60.0);
        let mut way = 0.0;
        let mut longest = 0.0_f64;
        let mut frames = 0;
        while flyer.is_moving() && frames < 100 {
            assert!(step(&mut flyer, &terrain, FRAME_S, NONE));
            let now = flyer.camera(&terrain, 60.0);
            assert!(degrees_between(&before, &now) < 10.0, "frame {frames} on {}", terrain.base());
            let moved = before.eye_m.distance(now.eye_m);
            (way, longest) = (way + moved, longest.max(moved));
            before = now;
            frames += 1;
        }
        assert!((70..75).contains(&frames), "{frames} frames");
        // The middle of the ease is half as fast again as the mean.
        assert!(longest < 2.0 * way / f64::from(frames), "a leap on {}", terrain.base());
        assert_eq!(flyer.pose(), goal);
        assert!(!step(&mut flyer, &terrain, FRAME_S, NONE));
        assert_eq!(flyer.pose(), goal);
    }
}

#[test]
fn hands_end_a_flight() {
    let (terrain, [start, goal]) = worlds().swap_remove(0);
    let mut flyer = standing(&terrain, start);
    let begun = |flyer: &mut Flyer| {
        flyer.fly_to(&terrain, goal);
        for _ in 0..20 {
            step(flyer, &terrain, FRAME_S, NONE);
        }
        assert!(flyer.is_moving());
    };
    begun(&mut flyer);
    step(&mut flyer, &terrain, FRAME_S, FORWARD);
    assert!(!flyer.is_moving());
    begun(&mut flyer);
    flyer.look([5.0, 0.0], 60.0);
    assert!(!flyer.is_moving());
    begun(&mut flyer);
    flyer.begin_orbit(DVec3::ZERO);
    assert!(!flyer.is_moving());
    flyer.fly_to(&terrain, [f64::NAN, 0.0, 0.0, 0.0, 0.0]);
    assert!(!flyer.is_moving());
}

#[test]
fn a_double_click_leads_straight_towards_the_point() {
    for (terrain, [pose, _]) in worlds() {
        let flyer = standing(&terrain, pose);
        let camera = flyer.camera(&terrain, 60.0);
        let reach = 0.2 * pose[2];
        let ray = camera.ray([900, 300], [1280, 720]).normalize();
        let point = camera.eye_m + ray * reach;
        let free = |_: DVec3| None;
        let goal = flyer.double_click_goal(&terrain, &camera, point, &Ground { above: &free });
        let there = terrain.camera(goal, 60.0);
        assert!((there.eye_m.distance(point) / (0.25 * reach) - 1.0).abs() < 1e-6, "{}", terrain.base());
        assert!((point - there.eye_m).normalize().distance(ray) < 1e-6, "{}", terrain.base());
        assert!(there.forward().distance(camera.forward()) < 1e-6, "{}", terrain.base());
        // Close to the ground it keeps off.
        let touching = |p: DVec3| Some((p - there.eye_m).dot(there.axes.z_axis));
        let goal = flyer.double_click_goal(&terrain, &camera, point, &Ground { above: &touching });
        let off = touching(terrain.camera(goal, 60.0).eye_m).unwrap();
        assert!((off / flyer.scale.stand_off_m - 1.0).abs() < 1e-3, "{off} m on {}", terrain.base());
        assert!(flyer.scale.stand_off_m >= 3.0);
    }
}

#[test]
fn coordinates_without_a_height_lie_over_the_ground() {
    for (terrain, [pose, there]) in worlds() {
        let flyer = standing(&terrain, pose);
        let ground = |p: DVec3| above(&terrain, p);
        let go =
            |height| flyer.go_to_goal(&terrain, [there[0], there[1]], height, &Ground { above: &ground });
        assert_eq!(go(Some(12.5)), [there[0], there[1], 12.5, pose[3], pose[4]]);
        let goal = go(None);
        let above_m = ground(terrain.camera(goal, 60.0).eye_m).unwrap();
        assert!((above_m / flyer.scale.go_to_m - 1.0).abs() < 1e-6, "{above_m} m on {}", terrain.base());
    }
    assert_eq!(standing(&mountains(), [0.0; 5]).scale.go_to_m, 1_500.0);
}

#[test]
fn an_orbit_keeps_distance_and_picture() {
    for (terrain, [pose, _]) in worlds() {
        let mut flyer = standing(&terrain, pose);
        let camera = flyer.camera(&terrain, 60.0);
        let reach = 0.2 * pose[2];
        let centre = camera.eye_m + camera.ray([500, 600], [1280, 720]).normalize() * reach;
        let distance = camera.eye_m.distance(centre);
        let seen = |camera: &Camera| {
            let [right, up] = camera.right_and_up();
            let to = centre - camera.eye_m;
            DVec3::new(to.dot(right), to.dot(up), to.dot(camera.forward())) / distance
        };
        let at_first = seen(&camera);
        flyer.begin_orbit(centre);
        let mut turned = 0.0_f64;
        for k in 0..120 {
            flyer.orbit([17.0, 12.0 * (f64::from(k) * 0.1).sin()], &terrain, [1280, 720], &NO_GROUND);
            let now = flyer.camera(&terrain, 60.0);
            assert!((now.eye_m.distance(centre) / distance - 1.0).abs() < 1e-9, "{}", terrain.base());
            turned = turned.max(degrees_between(&camera, &now));
            // Where the surface bends unevenly the horizon cannot stay level.
            let most = match terrain.base() {
                Base::Plane | Base::Sampled => 1e-9,
                Base::Ellipsoid { .. } => 1e-2,
                _ => continue,
            };
            assert!(seen(&now).distance(at_first) < most, "{} turn {k}: {}", terrain.base(), seen(&now));
        }
        assert!(turned > 90.0, "{turned} degrees on {}", terrain.base());
        flyer.end_orbit();
        let ended = flyer.pose();
        flyer.orbit([100.0, 100.0], &terrain, [1280, 720], &NO_GROUND);
        assert_eq!(flyer.pose(), ended);
    }
}

#[test]
fn an_orbit_follows_the_hand_and_stops_short_of_the_vertical() {
    let terrain = mountains();
    let pose = [3_000.0, 3_000.0, 5_000.0, 0.0, -30.0];
    let mut flyer = standing(&terrain, pose);
    let camera = flyer.camera(&terrain, 60.0);
    let centre = camera.eye_m + camera.forward() * 1_000.0;
    flyer.begin_orbit(centre);
    // A quarter of the picture's height: the ground turns with the hand.
    flyer.orbit([180.0, 0.0], &terrain, [1280, 720], &NO_GROUND);
    assert!((flyer.pose()[3] - 45.0).abs() < 1e-9 && eye(&flyer, &terrain).x < camera.eye_m.x - 100.0);
    let elevation = |flyer: &Flyer| ((eye(flyer, &terrain).z - centre.z) / 1_000.0).asin().to_degrees();
    flyer.orbit([0.0, 80.0], &terrain, [1280, 720], &NO_GROUND);
    assert!((elevation(&flyer) - 50.0).abs() < 1e-6 && (flyer.pose()[4] + 50.0).abs() < 1e-6);
    for (down, limit) in [(200.0, 85.0), (-200.0, -85.0)] {
        for _ in 0..10 {
            flyer.orbit([3.0, down], &terrain, [1280, 720], &NO_GROUND);
        }
        assert!((elevation(&flyer) - limit).abs() < 1e-5, "{} degrees", elevation(&flyer));
    }
    // A centre above the middle of the picture: the view itself must not turn over.
    flyer.set_pose(pose);
    flyer.begin_orbit(camera.eye_m + camera.ray([640, 30], [1280, 720]).normalize() * 1_000.0);
    let mut before = flyer.camera(&terrain, 60.0);
    for _ in 0..60 {
        flyer.orbit([0.0, 20.0], &terrain, [1280, 720], &NO_GROUND);
        let now = flyer.camera(&terrain, 60.0);
        assert!(before.right_and_up()[0].dot(now.right_and_up()[0]) > 0.999, "{:?}", flyer.pose());
        before = now;
    }
    assert!(flyer.pose()[4] < -89.0, "{:?}", flyer.pose());
}

#[test]
fn no_input_makes_a_camera_that_cannot_be_drawn() {
    let mut tiny = HeightGrid::new(2, 2, vec![0.0; 4]).unwrap();
    tiny.spacing_m = [1e-6; 2];
    let point = PositionGrid::new(2, 2, vec![[0.0; 3]; 4]).unwrap();
    let mut terrains: Vec<Terrain> = worlds().into_iter().map(|(terrain, _)| terrain).collect();
    terrains.push(Terrain::new(&tiny, Prefilter::Subsample));
    terrains.push(Terrain::sampled(point));
    terrains.push(plane("procedural:mountains?size=65&spacing=1e9"));
    let far = |_: DVec3| Some(-1e300);
    let nan = |_: DVec3| Some(f64::NAN);
    let none = |_: DVec3| None;
    let grounds: [&dyn Fn(DVec3) -> Option<f64>; 3] = [&far, &nan, &none];
    let all = Held { forward: true, up: true, right: true, fast: true, ..NONE };
    for terrain in terrains {
        let mut flyer = Flyer::new(&terrain, &terrain.overview(60.0));
        flyer.scale_speed(1e300);
        for round in 0..40 {
            for dt_s in [f64::NAN, -1.0, 0.0, 1e-300, 1e300, f64::INFINITY, 0.1] {
                let ground = Ground { above: grounds[round % 3] };
                flyer.set_following(round % 5 == 4, Some(f64::NAN).filter(|_| round % 2 == 0));
                flyer.step(dt_s, &if round % 2 == 0 { all } else { DOWN }, &terrain, &ground);
                assert!(flyer.camera(&terrain, 60.0).validate().is_ok(), "{:?}", flyer.pose());
            }
            let round = round as f64;
            flyer.look([1e30 * round, f64::NAN], 60.0);
            flyer.look([33.0 * round, 1e300], 60.0);
            flyer.begin_orbit(DVec3::splat(1e300));
            flyer.orbit([1e30, round], &terrain, [0, 0], &NO_GROUND);
            flyer.orbit([f64::NAN, 1.0], &terrain, [1280, 720], &NO_GROUND);
            flyer.begin_orbit(eye(&flyer, &terrain));
            flyer.orbit([5.0, 5.0], &terrain, [1280, 720], &NO_GROUND);
            flyer.set_pose([f64::INFINITY, 0.0, 0.0, 0.0, 0.0]);
            flyer.fly_to(&terrain, [1e300, 0.0, -1e300, 1e300, 1e300]);
            flyer.step(0.1, &NONE, &terrain, &Ground { above: &none });
            let camera = flyer.camera(&terrain, 60.0);
            assert!(camera.validate().is_ok(), "{:?} on {}", flyer.pose(), terrain.base());
            assert!(flyer.pose()[4].abs() <= 90.0);
        }
    }
}

#[test]
fn an_orbit_stops_short_of_the_ground() {
    let terrain = mountains();
    let mut flyer = standing(&terrain, [1_500.0, 500.0, 2_500.0, 45.0, -40.0]);
    let above = |p: DVec3| terrain.surface_at(p).map(|spot| spot.above_m);
    let ground = Ground { above: &above };
    let camera = flyer.camera(&terrain, 60.0);
    let centre = terrain.pick(camera.eye_m, camera.forward(), 1e5).expect("ground ahead");
    flyer.begin_orbit(centre);
    for _ in 0..200 {
        flyer.orbit([4.0, -6.0], &terrain, [1280, 720], &ground);
        let camera = flyer.camera(&terrain, 60.0);
        assert!(above(camera.eye_m).is_none_or(|m| m > 0.0), "{:?}", flyer.pose());
        let seen = (centre - camera.eye_m).normalize().dot(camera.forward());
        assert!((seen - 1.0).abs() < 1e-9, "the centre stays in the middle: {seen}");
    }
}
