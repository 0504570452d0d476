//! The controller of a scene for a plant that is not ours: reads the true angles and speeds of the joints from stdin, writes the
//! torques on them to stdout, a control period each, until stdin ends.
//!
//!     tick SCENE.toml
//!
//! Numbers are 64-bit floats, little-endian, in the hand's order of joints: angles, speeds; torques. Between them are the scene's encoders
//! with their noise, the tick that the microcontroller runs, the output delay and the motors' limits. The first period arms the
//! hand, while everything stands still, and begins the grasp. A fault is told on stderr. Of gravity that
//! turns it is not told.

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::Scene;
use blindgrasp::sim::controller::{Alone, Controller, Reach, Turn};
use blindgrasp::sim::delay::Delay;
use blindgrasp::sim::encoders::Encoders;
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::tick::Sensed;
use std::error::Error;
use std::io::{ErrorKind, Read, Write, stdin, stdout};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("which scene?")?;
    let scene = Scene::load(path, &[])?;
    if scene.actuators.output_delay_ticks.fract() != 0.0 {
        return Err("torques are exchanged once a tick: the delay has to be in whole ticks".into());
    }
    let count = scene.joints.len();
    let (mut controller, mut encoders) = (Alone::new(&scene)?, Encoders::new(&scene));
    let mut delay: Option<Delay> = None;
    let mut fault = None;
    let (mut input, mut output) = (stdin().lock(), stdout().lock());
    let mut numbers = vec![0; 2 * 8 * count];
    loop {
        match input.read_exact(&mut numbers) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(()),
            read => read?,
        }
        let mut values =
            numbers.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap_or_default()));
        let (mut angles_rad, mut speeds_rad_s) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for part in [&mut angles_rad, &mut speeds_rad_s] {
            part[..count].fill_with(|| values.next().unwrap_or_default());
        }
        let mut control = |command| {
            let counts = if scene.sensors.ideal { [0; MAX_JOINTS] } else { encoders.read(&angles_rad) };
            let (angles, speeds) = (angles_rad.map(|v| v as f32), speeds_rad_s.map(|v| v as f32));
            let sensed = if scene.sensors.ideal {
                Sensed::Ideal { angles_rad: &angles, speeds_rad_s: &speeds }
            } else {
                Sensed::Counts(&counts)
            };
            controller.step(&Turn {
                sensed,
                late: false,
                command,
                reach: Reach::Everything,
                gravity_m_s2: None,
            })
        };
        let stepped = match &delay {
            Some(_) => control(None)?,
            None => {
                let armed = control(Some(Command::Arm))?;
                delay = Some(Delay::new(scene.actuators.output_delay_ticks, armed.torques_nm));
                control(Some(Command::Grasp(Grasp::CONFIGURED)))?
            }
        };
        if stepped.fault != fault {
            fault = stepped.fault;
            eprintln!("fault: {fault:?}");
        }
        let torques_nm = delay.as_mut().map_or(stepped.torques_nm, |delay| delay.pass(stepped.torques_nm));
        for (torque_nm, joint) in torques_nm.iter().zip(&scene.joints) {
            let most_nm = joint.torque_limit_nm;
            output.write_all(&f64::from(*torque_nm).clamp(-most_nm, most_nm).to_le_bytes())?;
        }
        output.flush()?;
    }
}
