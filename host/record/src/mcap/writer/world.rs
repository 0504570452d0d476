//! What only a simulation knows, beside what its device says: the true state of its world, on channels of its own, and the shapes
//! of hand and object, as attachments.
//!
//! Times are those of the tick that found the world so. Frames, positions and forces are in the base frame of the hand, which the
//! URDF calls `base` too.

use super::Writer;
use crate::mcap::message::write_time;
use crate::mcap::protobuf::{double, nested, present_double, text};
use crate::mcap::schema::{Field, Message, Type, field, message, time, timed, typed};
use crate::mcap::{Device, RecordingError, Stamp};
use ::mcap::Attachment;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A channel of the world.
#[derive(Clone, Copy)]
enum Truth {
    Object,
    Joints,
    Contacts,
}

impl Truth {
    const ALL: [Self; 3] = [Self::Object, Self::Joints, Self::Contacts];

    /// Number, topic and schema. The numbers are among those that [no device has](crate::mcap::Kind::of_channel).
    fn channel(self) -> (u16, &'static str, &'static str) {
        match self {
            Self::Object => (0x4000, "/truth/object", "foxglove.FrameTransform"),
            Self::Joints => (0x4008, "/truth/joints", "foxglove.JointStates"),
            Self::Contacts => (0x4010, "/truth/contacts", "blindgrasp.Contacts"),
        }
    }

    /// Writes the message of a tick.
    fn write(self, bytes: &mut Vec<u8>, at: Stamp, world: &World<'_>, joint_names: &[String]) {
        write_time(bytes, at);
        match self {
            Self::Object => {
                text(bytes, 2, "base");
                text(bytes, 3, "object");
                vector(bytes, 4, &world.position_m);
                vector(bytes, 5, &world.attitude);
            }
            Self::Joints => {
                for (k, name) in joint_names.iter().enumerate() {
                    nested(bytes, 2, |bytes| {
                        text(bytes, 1, name);
                        let signals = [(2, world.angles_rad), (3, world.speeds_rad_s), (5, world.torques_nm)];
                        for (number, signal) in signals {
                            present_double(bytes, number, signal.get(k).copied().unwrap_or(f64::NAN));
                        }
                    });
                }
            }
            Self::Contacts => {
                for (number, contacts) in [(2, world.contacts), (3, world.others)] {
                    for contact in contacts {
                        nested(bytes, number, |bytes| {
                            vector(bytes, 1, &contact.point_m);
                            vector(bytes, 2, &contact.force_n);
                            for (number, value) in [(3, contact.friction_used), (4, contact.slipped_m)] {
                                if let Some(value) = value {
                                    present_double(bytes, number, value);
                                }
                            }
                        });
                    }
                }
            }
        }
    }
}

/// The true state of a simulated world at a tick.
#[derive(Clone, Copy, Debug)]
pub struct World<'a> {
    /// The object's centre of mass, m.
    pub position_m: [f64; 3],
    /// The object's attitude, a unit quaternion `(x, y, z, w)`.
    pub attitude: [f64; 4],
    /// Joint angles, rad.
    pub angles_rad: &'a [f64],
    /// Joint speeds, rad/s.
    pub speeds_rad_s: &'a [f64],
    /// Torques on the joints, N m.
    pub torques_nm: &'a [f64],
    /// The contact of each finger, with the force on the object.
    pub contacts: &'a [Contact],
    /// All other contacts: with tables, of links, of parts of the hand with each other.
    pub others: &'a [Contact],
}

/// A contact at a tick.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Its place, m.
    pub point_m: [f64; 3],
    /// Its force, N.
    pub force_n: [f64; 3],
    /// Share of the limit of friction that is used, where there is friction: 1 where it slips.
    pub friction_used: Option<f64>,
    /// Way that it has slipped since the start, where that is known, m.
    pub slipped_m: Option<f64>,
}

impl Writer {
    /// Adds the channels of a simulated world, and the shapes in it: the hand as a URDF, the object as an OBJ file in metres, in its
    /// own frame.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn add_world(&mut self, hand_urdf: &str, object_obj: &str) -> Result<(), RecordingError> {
        let mcap = self.mcap()?;
        for (name, media_type, content) in
            [("hand.urdf", "application/xml", hand_urdf), ("object.obj", "model/obj", object_obj)]
        {
            let data = Cow::Borrowed(content.as_bytes());
            let (name, media_type) = (name.into(), media_type.into());
            mcap.attach(&Attachment { log_time: 0, create_time: 0, name, media_type, data })?;
        }
        for (number, topic, schema) in Truth::ALL.map(Truth::channel) {
            let schema = mcap.add_schema(schema, "protobuf", &descriptors(schema))?;
            mcap.add_channel_with_id(number, schema, topic, "protobuf", &BTreeMap::new())?;
        }
        Ok(())
    }

    /// The world at the tick of a device's last record.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn world(&mut self, device: Device, at: Stamp, world: &World<'_>) -> Result<(), RecordingError> {
        let mut bytes = std::mem::take(&mut self.buffer);
        for truth in Truth::ALL {
            bytes.clear();
            truth.write(&mut bytes, at, world, &self.devices[device.0].joint_names);
            self.write_to(truth.channel().0, at, &bytes)?;
        }
        self.buffer = bytes;
        self.settle(at)
    }
}

fn vector(bytes: &mut Vec<u8>, number: u32, values: &[f64]) {
    nested(bytes, number, |bytes| {
        (1..).zip(values).for_each(|(number, &value)| double(bytes, number, value));
    });
}

/// The descriptors of a schema, with all that it needs in one file.
fn descriptors(schema: &str) -> Vec<u8> {
    let (package, name) = schema.split_once('.').unwrap_or_default();
    let inner = |name: &str, number, of: &str| typed(name, number, Type::Message, format!(".{package}.{of}"));
    let several = |field| Field { repeated: true, ..field };
    let doubles = |name: &str, components: &[&str]| -> Message {
        let fields = components.iter().zip(1..).map(|(name, number)| field(name, number, Type::Double));
        message(name, fields.collect())
    };
    let optional = |name: &str, number| Field { optional: true, ..field(name, number, Type::Double) };
    let time = time();
    let vector3 = |name: &str| doubles(name, &["x", "y", "z"]);
    let messages = match name {
        "FrameTransform" => vec![
            vector3("Vector3"),
            doubles("Quaternion", &["x", "y", "z", "w"]),
            message(
                name,
                vec![
                    time,
                    field("parent_frame_id", 2, Type::String),
                    field("child_frame_id", 3, Type::String),
                    inner("translation", 4, "Vector3"),
                    inner("rotation", 5, "Quaternion"),
                ],
            ),
        ],
        "JointStates" => vec![
            message(
                "JointState",
                vec![
                    field("name", 1, Type::String),
                    optional("position", 2),
                    optional("velocity", 3),
                    optional("acceleration", 4),
                    optional("effort", 5),
                ],
            ),
            message(name, vec![time, several(inner("joints", 2, "JointState"))]),
        ],
        _ => vec![
            vector3("Vector3"),
            message(
                "Contact",
                vec![
                    inner("point_m", 1, "Vector3"),
                    inner("force_n", 2, "Vector3"),
                    optional("friction_used", 3),
                    optional("slipped_m", 4),
                ],
            ),
            message(
                name,
                vec![time, several(inner("contacts", 2, "Contact")), several(inner("others", 3, "Contact"))],
            ),
        ],
    };
    timed(schema, &messages)
}
