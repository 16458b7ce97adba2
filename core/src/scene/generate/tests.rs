use super::*;
use crate::scene::BACKGROUND;

#[test]
fn fifty_seeds_reach_their_fill_without_overlap_and_repeat() {
    let catalog = Catalog::standard();
    let config = GenerateConfig::default();
    let mut counts = [0_usize; OBJECT_CLASS_COUNT];
    let mut first: Option<Scene> = None;
    for seed in 0..50 {
        let scene = generate(&catalog, &config, seed).expect("scene");
        assert_eq!(scene.check(&catalog).expect("sound"), Vec::<String>::new());
        let (fill, target) = (scene.fill(&catalog).expect("fill"), config.target_fill(seed));
        assert!((0.30..=0.45).contains(&target));
        assert!((fill - target).abs() < 0.01, "seed {seed}: {fill} for {target}");
        assert_eq!(generate(&catalog, &config, seed).expect("again"), scene);
        assert_ne!(first.as_ref().map(|first| &first.objects), Some(&scene.objects));
        for object in &scene.objects {
            assert!((0.0..180.0).contains(&object.yaw_deg));
            counts[catalog.by_name(&object.class).expect("class").id.index()] += 1;
        }
        first.get_or_insert(scene);
    }
    assert!(counts.iter().all(|count| *count > 0), "every class appears: {counts:?}");
}

#[test]
fn yaws_are_spread_over_half_a_turn() {
    let catalog = Catalog::standard();
    let mut bins = [0_usize; 6];
    for seed in 0..40 {
        for object in generate(&catalog, &GenerateConfig::default(), seed).expect("scene").objects {
            bins[(object.yaw_deg / 30.0) as usize] += 1;
        }
    }
    let mean = bins.iter().sum::<usize>() as f32 / 6.0;
    assert!(bins.iter().all(|n| (*n as f32 / mean - 1.0).abs() < 0.35), "{bins:?}");
}

#[test]
fn crowded_shelves_are_reached() {
    let catalog = Catalog::standard();
    let config = GenerateConfig { fill: [0.45, 0.45], ..GenerateConfig::default() };
    for seed in 0..20 {
        let fill = generate(&catalog, &config, seed).expect("scene").fill(&catalog).expect("fill");
        assert!((fill - 0.45).abs() < 0.01, "seed {seed}: {fill}");
    }
}

#[test]
fn a_fill_out_of_reach_shows_below_the_target() {
    let catalog = Catalog::standard();
    let config = GenerateConfig { fill: [0.9, 0.9], classes: vec![ClassId(11)], ..GenerateConfig::default() };
    let scene = generate(&catalog, &config, 1).expect("scene");
    scene.check(&catalog).expect("sound");
    let fill = scene.fill(&catalog).expect("fill");
    assert!(fill > 0.2 && fill < config.target_fill(1) - 0.01, "{fill}");
}

#[test]
fn regularity_lines_objects_up() {
    let catalog = Catalog::standard();
    let in_line = |rho: f32| {
        let config = GenerateConfig { rho, ..GenerateConfig::default() };
        let mut aligned = 0.0;
        let mut all = 0.0;
        for seed in 0..20 {
            let objects = generate(&catalog, &config, seed).expect("scene").objects;
            for (at, object) in objects.iter().enumerate().skip(1) {
                let near = |other: &Object| (other.position[0] - object.position[0]).abs() < 0.008;
                aligned += if objects[..at].iter().any(near) { 1.0 } else { 0.0 };
                all += 1.0;
            }
        }
        aligned / all
    };
    let (loose, strict) = (in_line(0.0), in_line(1.0));
    assert!(strict > loose + 0.25, "{loose} {strict}");
}

#[test]
fn affinities_draw_an_own_class_near() {
    let catalog = Catalog::standard();
    let near = [Standing { class: ClassId(5), position: [0.0, 0.2], outline: Vec::new() }];
    let weights = class_weights(&catalog, &near, [0.1, 0.2]);
    let total: f64 = weights.iter().sum();
    // Own chance .70 of cracker boxes; 14 classes and 6 doubled ones share the rest; large ones weigh 1.25.
    let others: f64 = 0.30 / 20.0;
    let sum: f64 = catalog
        .classes
        .iter()
        .map(|class| {
            let base = if class.large { 1.25 } else { 1.0 };
            let doubled = if [0, 2, 4, 7, 8, 12].contains(&class.id.0) { 2.0 } else { 1.0 };
            base * (others * doubled + if class.id.0 == 5 { 0.70 } else { 0.0 })
        })
        .sum();
    assert!((weights[5] / total - 1.25 * (others + 0.70) / sum).abs() < 1e-6);
    assert!((weights[8] / weights[9] - 2.0).abs() < 1e-6, "cookie boxes are doubled, meat cans are not");
    let far = class_weights(&catalog, &near, [0.21, 0.2]);
    assert_eq!((far[5], far[9]), (LARGE_WEIGHT, 1.0), "outside the radius nothing changes");
}

#[test]
fn what_is_there_stays() {
    let catalog = Catalog::standard();
    let keep = vec![Object::new("pasta_box", [0.0, 0.2], 30.0), Object::new("gum_tin", [0.3, 0.1], 0.0)];
    let config = GenerateConfig { keep: keep.clone(), ..GenerateConfig::default() };
    let scene = generate(&catalog, &config, 3).expect("scene");
    scene.check(&catalog).expect("sound");
    assert_eq!(scene.objects[..2], keep);
    assert!(scene.objects.len() > 8);
    let around = GenerateConfig::around(&scene);
    assert_eq!(around.keep, scene.objects);
}

#[test]
fn only_listed_classes_and_only_such_as_have_room() {
    let catalog = Catalog::standard();
    let shelf = Shelf::new([0.6, 0.3, 0.12]);
    let low = GenerateConfig { shelf, ..GenerateConfig::default() };
    let scene = generate(&catalog, &low, 8).expect("scene");
    scene.check(&catalog).expect("sound");
    assert!(
        scene
            .objects
            .iter()
            .all(|object| catalog.by_name(&object.class).is_some_and(|c| c.solid.bounds().max.z < 0.12))
    );
    let cans = GenerateConfig { classes: vec![ClassId(1), ClassId(3)], ..GenerateConfig::default() };
    let scene = generate(&catalog, &cans, 8).expect("scene");
    assert!(scene.objects.iter().all(|object| ["tomato_can", "gum_tin"].contains(&object.class.as_str())));
    scene.check(&catalog).expect("sound");
}

#[test]
fn senseless_wishes_are_refused() {
    let catalog = Catalog::standard();
    let refused = |config: GenerateConfig| generate(&catalog, &config, 0).expect_err("refused").to_string();
    let base = GenerateConfig::default;
    assert!(refused(GenerateConfig { fill: [0.5, 0.4], ..base() }).starts_with("fill 0.5 to 0.4"));
    assert!(refused(GenerateConfig { fill: [f32::NAN, 0.4], ..base() }).starts_with("fill NaN"));
    assert!(refused(GenerateConfig { rho: 1.5, ..base() }).starts_with("rho 1.5"));
    assert!(refused(GenerateConfig { classes: vec![BACKGROUND], ..base() }).starts_with("class 14"));
    assert!(refused(GenerateConfig { shelf: Shelf::new([9.0, 0.4, 0.4]), ..base() }).contains("shelf size 9 m"));
}

#[test]
fn shelves_of_every_family_are_sound_stand_still_and_repeat() {
    let catalog = Catalog::standard();
    for family in Family::ALL {
        let config = GenerateConfig::of_family(family);
        let mut different = 0;
        for seed in 0..6 {
            let scene = generate(&catalog, &config, seed).expect("scene");
            assert_eq!(scene.check(&catalog).expect("sound"), Vec::<String>::new(), "{family} {seed}");
            let fill = scene.fill(&catalog).expect("fill");
            let [low, high] = family.fill();
            assert!((low - 0.03..high + 0.08).contains(&fill), "{family} {seed}: {fill}");
            assert_eq!(generate(&catalog, &config, seed).expect("again"), scene);
            different += usize::from(generate(&catalog, &config, seed + 100).expect("other").objects != scene.objects);
            let mut world = crate::world::World::new(scene.shelf, scene.bodies(&catalog).expect("bodies"));
            let moved = world.settle();
            assert!(moved < 0.005, "{family} {seed}: {moved} m");
            assert_eq!(world.bodies().len(), scene.objects.len());
        }
        assert_eq!(different, 6, "{family}");
    }
}

#[test]
fn a_structure_keeps_to_listed_classes_and_clear_of_kept_objects() {
    let catalog = Catalog::standard();
    let keep = vec![Object::new("cereal_box", [0.0, 0.2], 30.0)];
    for family in Family::ALL {
        let classes = vec![ClassId(0), ClassId(3)];
        let config = GenerateConfig { classes, keep: keep.clone(), ..GenerateConfig::of_family(family) };
        let scene = generate(&catalog, &config, 1).expect("scene");
        scene.check(&catalog).expect("sound");
        assert_eq!(scene.objects[0], keep[0]);
        assert!(scene.objects.len() > 3);
        assert!(scene.objects[1..].iter().all(|object| ["chips_can", "gum_tin"].contains(&object.class.as_str())));
    }
}

#[test]
fn families_are_read_by_their_names() {
    assert!(Family::ALL.into_iter().all(|family| family.to_string().parse() == Ok(family)));
    let error = "wall".parse::<Family>().expect_err("unknown");
    assert!(error.contains("\"wall\"") && error.contains("tall-first") && !error.contains('\n'), "{error}");
}
