//! A hand that objects are placed in, with all that does not depend on the object.

use super::DENSITY_KG_M3;
use crate::{NoPlacement, Placement, Reach, Request, place};
use blindgrasp_model::file::{ObjectFile, SceneFile, ShapeFile};
use blindgrasp_model::{Parts, SceneError};

/// A hand that objects are placed in.
#[derive(Clone, Debug)]
pub struct PlacingHand {
    like: SceneFile,
    reach: Reach,
}

impl PlacingHand {
    /// The hand of a scene, with its gains and all else that stands there; its contacts do nothing.
    ///
    /// # Errors
    /// What is wrong with the scene.
    pub fn of(mut like: SceneFile) -> Result<Self, SceneError> {
        like.contacts.clear();
        let reach = Reach::of_scene(&like, &Parts::of(&like)?)?;
        Ok(Self { like, reach })
    }

    /// A convex hull of styrene foam as an object. Points are in metres.
    pub fn hull(&self, points_m: Vec<[f64; 3]>) -> ObjectFile {
        ObjectFile {
            name: "polyhedron".to_owned(),
            mass_kg: None,
            density_kg_m3: Some(DENSITY_KG_M3),
            shape: ShapeFile::Hull { points_m },
            ..self.like.object.clone()
        }
    }

    /// The best placements of an object in the attitude in which it is described, at most `most`, the best first.
    ///
    /// # Errors
    /// Why there is none.
    pub fn place(&self, object: ObjectFile, most: usize) -> Result<Vec<Placement>, NoPlacement> {
        let like = SceneFile { object, ..self.like.clone() };
        let parts = Parts::of(&like)?;
        let request = Request {
            like: &like,
            parts: &parts,
            reach: &self.reach,
            any_position: true,
            any_attitude: false,
        };
        place(&request, most)
    }
}
