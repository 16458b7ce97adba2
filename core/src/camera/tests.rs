use super::*;
use crate::scene::{BACKGROUND, Body, ClassId, ObjectId, Shelf};
use crate::solid::{ConvexPart, Solid};
use crate::world::{TruthMap, shelf_panels};
use nalgebra::{Translation3, UnitQuaternion};
use proptest::prelude::*;
use std::sync::Arc;

fn shelf() -> Shelf {
    Shelf::new([0.80, 0.40, 0.40])
}

fn body(id: u16, solid: Solid, pose: Pose) -> Body {
    Body {
        id: ObjectId(id),
        class: ClassId((id % 14) as u8),
        solid: Arc::new(solid),
        world_from_body: pose,
        mass_kg: 0.4,
        friction: 0.5,
    }
}

fn standing(id: u16, solid: Solid, x: f32, y: f32, yaw: f32) -> Body {
    let rotation = UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw);
    body(id, solid, Pose::from_parts(Translation3::new(x, y, 0.0), rotation))
}

fn cylinder(radius: f32, height: f32) -> Solid {
    let ring = (0..24).flat_map(|i| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 24.0).sin_cos();
        [0.0, height].map(|z| Point::new(radius * cos, radius * sin, z))
    });
    Solid { parts: ConvexPart::hull(&ring.collect::<Vec<_>>()).into_iter().collect() }
}

fn crowd(count: u16) -> Vec<Body> {
    (0..count)
        .map(|i| {
            let (x, y) = (-0.32 + 0.16 * f32::from(i % 5), 0.05 + 0.1 * f32::from(i / 5));
            let solid = if i % 2 == 0 {
                cylinder(0.035, 0.1 + 0.01 * f32::from(i))
            } else {
                Solid::standing_box(Vector::new(0.06, 0.08, 0.2))
            };
            standing(i, solid, x, y, 0.3 * f32::from(i))
        })
        .collect()
}

fn standard() -> ViewArray {
    ViewArray::named("standard300").expect("shipped")
}

/// A view straight into the shelf from `position`.
fn straight(position: [f32; 3]) -> View {
    let text = format!(
        "format = 1\nname = \"x\"\nlayout = [1, 1, 1]\n\
         camera = {{ width = 64, height = 48, focal_px = 40.0, depth_range_m = [0.07, 1.5] }}\n\
         views = [{{ position = [{}, {}, {}], target = [{0}, 1.0, {2}], slot = [0, 0, 0] }}]",
        position[0], position[1], position[2]
    );
    ViewArray::parse("test", &text).expect("a view").views.remove(0)
}

/// What a frame shows, pixel by pixel.
struct Seen {
    depth_m: Vec<f32>,
    labels: Vec<u8>,
    objects: Vec<u16>,
}

impl Seen {
    fn of(sensed: Sensed) -> Self {
        let frame = sensed.frame;
        let labels = frame.labels().into_owned();
        Self { depth_m: frame.depth_m().to_vec(), labels, objects: sensed.objects.expect("of a simulator") }
    }
}

#[test]
fn a_box_has_the_depth_and_the_outline_that_geometry_says() {
    let intrinsics = standard().intrinsics;
    let view = straight([0.0, -0.3, 0.1]);
    let block = standing(3, Solid::standing_box(Vector::new(0.1, 0.1, 0.3)), 0.0, 0.25, 0.0);
    let image = Seen::of(render(&shelf(), &[block], &view, &intrinsics));
    let at = |column: usize, row: usize| row * intrinsics.width + column;
    // Its front is at y = 0.2, half a metre away: 0.1 m are 86.6 px.
    for (column, row) in [(320, 240), (280, 180), (360, 320)] {
        assert!((image.depth_m[at(column, row)] - 0.5).abs() < 1e-5);
        assert_eq!((image.labels[at(column, row)], image.objects[at(column, row)]), (3, 3));
    }
    let width = (0..640).filter(|&column| image.objects[at(column, 240)] == 3).count();
    assert!((86..=87).contains(&width), "{width}");
    // Beside it: the back wall; below: the board; above the ceiling's front edge: nothing but the front edge's face.
    assert!((image.depth_m[at(200, 240)] - 0.7).abs() < 1e-5);
    assert_eq!((image.labels[at(200, 240)], image.objects[at(200, 240)]), (BACKGROUND.0, u16::MAX));
    let down = intrinsics.ray(320, 370);
    assert!((image.depth_m[at(320, 370)] - 0.1 / down.y).abs() < 1e-5);
}

#[test]
fn the_shelf_hides_what_is_behind_its_panels() {
    let intrinsics = standard().intrinsics;
    // From below the board its front edge hides the shelf; a block behind it cannot be seen through it.
    let block = standing(3, Solid::standing_box(Vector::new(0.7, 0.05, 0.05)), 0.0, 0.2, 0.0);
    let image = Seen::of(render(&shelf(), &[block], &straight([0.0, -0.3, -0.01]), &intrinsics));
    let at = |column: usize, row: usize| row * intrinsics.width + column;
    assert!((image.depth_m[at(320, 240)] - 0.3).abs() < 1e-4, "the edge of the board");
    assert_eq!(image.labels[at(320, 240)], BACKGROUND.0);
    assert_eq!(image.depth_m[at(320, 400)], 0.0, "below the board there is nothing");
}

/// The first hit by brute force: every part in its body's frame, with [`ConvexPart::ray_enter`].
fn cast(shelf: &Shelf, bodies: &[Body], from: Point, ray: Vector, range: [f32; 2]) -> (f32, u16) {
    let mut best = (f32::INFINITY, u16::MAX);
    for panel in shelf_panels(shelf) {
        let size = panel.size();
        let base = Pose::translation(panel.min.x + 0.5 * size.x, panel.min.y + 0.5 * size.y, panel.min.z);
        let solid = Solid::standing_box(size);
        if let Some(t) = solid.parts[0].ray_enter(base.inverse_transform_point(&from), ray, 10.0)
            && t < best.0
        {
            best = (t, u16::MAX);
        }
    }
    for body in bodies {
        let local = body.world_from_body.inverse_transform_point(&from);
        let direction = body.world_from_body.inverse_transform_vector(&ray);
        for part in &body.solid.parts {
            if let Some(t) = part.ray_enter(local, direction, 10.0)
                && t < best.0
            {
                best = (t, body.id.0);
            }
        }
    }
    if best.0 >= range[0] && best.0 <= range[1] { best } else { (0.0, u16::MAX) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// The row scan is the ray cast: same depth and same object for every tested pixel but those on an outline.
    #[test]
    fn images_agree_with_single_rays(
        view in 0_usize..300, tilt in -1.0_f32..1.0, roll in -3.0_f32..3.0, lift in 0.0_f32..0.2, offset in 0_usize..17,
    ) {
        let array = standard();
        let mut bodies = crowd(15);
        for (i, body) in bodies.iter_mut().enumerate() {
            let turn = UnitQuaternion::from_euler_angles(tilt * i as f32 * 0.1, roll, tilt);
            body.world_from_body.rotation = turn * body.world_from_body.rotation;
            body.world_from_body.translation.vector.z = lift;
        }
        let view = &array.views[view];
        let image = Seen::of(render(&shelf(), &bodies, view, &array.intrinsics));
        let mut outline = 0;
        let mut tested = 0;
        for at in (offset..image.depth_m.len()).step_by(97) {
            let ray = view.world_from_camera.rotation * array.intrinsics.ray(at % 640, at / 640);
            let (depth, object) = cast(&shelf(), &bodies, view.position(), ray, array.intrinsics.depth_range_m);
            tested += 1;
            if object != image.objects[at] || (depth - image.depth_m[at]).abs() > 1e-4 {
                outline += 1;
            }
        }
        prop_assert!(outline * 1000 <= tested, "{outline} of {tested} pixels differ");
    }

    /// Without noise, a free voxel has nothing of an object in it but what a voxel's size allows, and an occupied
    /// voxel touches an object; closure (upright objects) keeps both true.
    #[test]
    fn projections_agree_with_the_truth(
        view in 0_usize..300, yaw in 0.0_f32..3.1, count in 1_u16..20, closure in prop::bool::ANY,
    ) {
        let array = standard();
        let shelf = Shelf { column_closure: closure, ..shelf() };
        let mut bodies = crowd(count);
        for body in &mut bodies {
            body.world_from_body.rotation *= UnitQuaternion::from_axis_angle(&Vector::z_axis(), yaw);
        }
        let view = &array.views[view];
        let observation = project(&render(&shelf, &bodies, view, &array.intrinsics).frame, &shelf);
        let grid = shelf.grid();
        let truth = TruthMap::of(&grid, &bodies);
        // The height of a point above the nearest face of any object; negative inside.
        let outside = |index: usize| {
            let center = grid.center(grid.voxel(index));
            let above = |body: &Body| {
                let local = body.world_from_body.inverse_transform_point(&center);
                let height = |part: &ConvexPart| {
                    part.planes.iter().map(|p| p.normal.dot(&local.coords) - p.offset).fold(f32::NEG_INFINITY, f32::max)
                };
                body.solid.parts.iter().map(height).fold(f32::INFINITY, f32::min)
            };
            bodies.iter().map(above).fold(f32::INFINITY, f32::min)
        };
        // Half a voxel's diagonal: a ray or a face that clips a corner of the voxel.
        let tolerance = 0.5 * grid.voxel_m * 3.0_f32.sqrt() + 2e-4;
        prop_assert!(!observation.free.is_empty());
        for index in observation.free.iter() {
            prop_assert!(!observation.occupied.contains(index), "both free and occupied");
            if truth.occupancy[index] == 1 {
                prop_assert!(outside(index) > -tolerance, "free at {:?}, {} m deep", grid.voxel(index), outside(index));
            }
        }
        for index in observation.occupied.iter() {
            prop_assert!(outside(index) < tolerance, "occupied at {:?}, {} m off", grid.voxel(index), outside(index));
        }
        for (cell, &label) in observation.labels.iter().enumerate() {
            if label != UNOBSERVED && label != truth.labels[cell] {
                // Wrong labels only beside an outline: some neighbour has that label in truth, or the top was unseen.
                let at = grid.cell(cell);
                let near = |dx: i32, dy: i32| {
                    let (x, y) = (i32::from(at.x) + dx, i32::from(at.y) + dy);
                    let inside = x >= 0 && y >= 0 && x < grid.dims[0] as i32 && y < grid.dims[1] as i32;
                    inside && truth.labels[x as usize * grid.dims[1] + y as usize] == label
                };
                prop_assert!((-1..=1).any(|dx| (-1..=1).any(|dy| near(dx, dy))), "label {label} at {at:?}");
            }
        }
    }
}

#[test]
fn a_free_column_and_an_occupied_one_are_closed() {
    let array = standard();
    let bodies = vec![standing(2, Solid::standing_box(Vector::new(0.1, 0.1, 0.15)), 0.0, 0.2, 0.0)];
    let view = &array.views[(5 * 10 + 5) * 3 + 1];
    let frame = render(&shelf(), &bodies, view, &array.intrinsics).frame;
    let grid = shelf().grid();
    let open = Shelf { column_closure: false, ..shelf() };
    let closed = project(&frame, &shelf());
    let raw = project(&frame, &open);
    assert!(closed.occupied.len() > raw.occupied.len() && closed.free.len() > raw.free.len());
    assert_eq!(closed.labels, raw.labels);
    let column = |x: f32, y: f32| grid.column(grid.cell_index(grid.cell_at(Point::new(x, y, 0.0)).expect("inside")));
    // The front row of the box is occupied to its top and free above; a cell beside it is free all the way up.
    let front: Vec<usize> = column(0.0, 0.1525).collect();
    assert!(front[..30].iter().all(|&at| closed.occupied.contains(at)));
    assert!(front[31..].iter().all(|&at| closed.free.contains(at)));
    assert!(column(0.2, 0.2).skip(1).all(|at| closed.free.contains(at)));
    // Behind the box nothing is known near the board.
    assert!(!closed.free.contains(column(0.0, 0.3).start) && !closed.occupied.contains(column(0.0, 0.3).start));
}

#[test]
fn images_and_projections_do_not_depend_on_threads() {
    let array = standard();
    let bodies = crowd(15);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let view = &array.views[130];
            let noise = NoiseModel::STANDARD;
            let aimed = noise.aim(view, 4, 2, |view| Ok(render(&shelf(), &bodies, view, &array.intrinsics)));
            let image = noise.apply(&aimed.expect("a frame"), 4, 2);
            let observation = project(&image, &shelf());
            let some = ViewArray { views: array.views[..9].to_vec(), ..array.clone() };
            (image, observation, visibility(&shelf(), &bodies, &some), TruthMap::of(&shelf().grid(), &bodies))
        })
    };
    let expected = run(1);
    assert!(run(2) == expected && run(5) == expected);
}

#[test]
fn an_object_behind_a_wall_of_boxes_is_hidden() {
    let mut bodies: Vec<Body> = (0..5)
        .map(|i| {
            let x = -0.32 + 0.16 * f32::from(i);
            standing(i, Solid::standing_box(Vector::new(0.159, 0.05, 0.39)), x, 0.1, 0.0)
        })
        .collect();
    bodies.push(standing(9, cylinder(0.035, 0.1), 0.0, 0.3, 0.0));
    let array = standard();
    assert_eq!(hidden_objects(&shelf(), &bodies, &array), vec![ObjectId(9)]);
    assert_eq!(hidden_count(&shelf(), &bodies, &array), 1);
    let rounds = std::cell::Cell::new(0);
    let twice = || rounds.replace(rounds.get() + 1) < 2;
    assert_eq!(hidden_objects_while(&shelf(), &bodies, &array, twice), None, "given up after two rounds");
    let all = visibility(&shelf(), &bodies, &array);
    assert!(all[5].is_hidden() && all[5].object == ObjectId(9) && all[..5].iter().all(|v| v.most_px > 10_000));
    // The fast search and the full count agree, and the count is that of the image.
    let image = Seen::of(render(&shelf(), &bodies, &array.views[usize::from(all[2].view.0)], &array.intrinsics));
    assert_eq!(image.objects.iter().filter(|object| **object == 2).count(), all[2].most_px);
    bodies.remove(2);
    assert_eq!(hidden_count(&shelf(), &bodies, &array), 0);
}
