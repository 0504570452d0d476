#![allow(missing_docs)]
use blindgrasp::plant::*;
use blindgrasp_tests::grasps::*;
use blindgrasp_tests::hands::*;
fn diff(a: &Motion, b: &Motion) -> [f64; 3] {
    let q = a.angles_rad.iter().zip(&b.angles_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    [q, (a.position_m - b.position_m).norm(), a.attitude.angle_to(&b.attitude)]
}
#[test]
fn x() {
    for (name, held) in [("cube", cube()), ("prism", prism())] {
        let mut g = Grasp::new(three_finger(), &held);
        for k in 0..12 {
            g.model.friction[k] = FRICTION;
        }
        let h = 5e-4;
        let mut p = g.plant(h);
        let sec = (1.0 / h) as usize;
        for s in 0..12 {
            g.run(&mut p, sec, |_| {});
            let m = p.motion();
            println!(
                "{name} law {s} dq {:.2e} dx {:.2e} w {:.2e}",
                m.speeds_rad_s.iter().fold(0.0f64, |a, v| a.max(v.abs())),
                m.velocity_m_s.norm(),
                m.spin_rad_s.norm()
            );
        }
        let u = g.torques(&p);
        let mut last = *p.motion();
        for s in 0..20 {
            g.drive(&mut p, sec, |_| u, |_| {});
            let m = *p.motion();
            println!(
                "{name} frozen {s} {:?} dq {:.2e} dx {:.2e} w {:.2e}",
                diff(&m, &last),
                m.speeds_rad_s.iter().fold(0.0f64, |a, v| a.max(v.abs())),
                m.velocity_m_s.norm(),
                m.spin_rad_s.norm()
            );
            last = m;
        }
    }
}
