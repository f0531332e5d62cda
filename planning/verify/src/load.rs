//! The files of a question, brought into one plane.

use crate::VerifyError;
use crate::ground::Ground;
use crate::ground_file::{self, Role};
use crate::plan::Plan;
use crate::plan_file;
use crate::plane::Plane;
use skein_interop::place::LatLon;

/// A text and the name of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// What the file is called.
    pub name: String,
    /// What it holds.
    pub text: String,
}

/// Reads plans that are flown together, an area and files of zones.
///
/// The plane is the one of the plans where they tell an origin, and touches the area's
/// first corner where they do not.
///
/// # Errors
/// [`VerifyError`] names the place; or the plans have different origins.
pub fn load(
    plans: &[File],
    area: Option<&File>,
    zones: &[File],
) -> Result<(Plan, Ground), VerifyError> {
    let mut files = Vec::new();
    if let Some(file) = area {
        files.push(ground_file::read(&file.name, &file.text, Role::Area)?);
    }
    for file in zones {
        files.push(ground_file::read(&file.name, &file.text, Role::Zones)?);
    }
    let mut origin: Option<LatLon> = None;
    for file in plans {
        let own = plan_file::origin(&file.name, &file.text)?;
        match (origin, own) {
            (Some(a), Some(b)) if a != b => {
                return Err(VerifyError::Together(format!(
                    "{}: its origin is not that of the plans before: recount them one by one",
                    file.name
                )));
            }
            _ => origin = origin.or(own),
        }
    }
    let mut somewhere = origin.or_else(|| files.iter().find_map(|f| f.somewhere()));
    for file in plans {
        if somewhere.is_none() {
            somewhere = plan_file::somewhere(&file.name, &file.text)?;
        }
    }
    let somewhere = somewhere.unwrap_or(LatLon {
        lat_deg: 0.0,
        lon_deg: 0.0,
    });
    let plane = Plane::at(somewhere);
    let mut ground = Ground::default();
    for file in &files {
        file.add_to(&mut ground, plane)?;
    }
    let mut all: Option<Plan> = None;
    for file in plans {
        let plan = plan_file::read(&file.name, &file.text, plane)?;
        all = Some(match all {
            Some(before) => before.and(plan)?,
            None => plan,
        });
    }
    Ok((all.unwrap_or_else(|| Plan::new(plane)), ground))
}
