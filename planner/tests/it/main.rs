//! The planner as its users see it.

#[cfg(test)]
mod anytime;
#[cfg(test)]
mod bounds;
#[cfg(test)]
mod certificate;
#[cfg(test)]
mod choices;
#[cfg(test)]
mod easy;
#[cfg(test)]
mod explained;
#[cfg(test)]
mod field;
#[cfg(test)]
mod floods;
#[cfg(test)]
mod hard;
#[cfg(test)]
mod legs;
#[cfg(test)]
mod obstacles;
#[cfg(test)]
mod priority;
#[cfg(test)]
mod random;
#[cfg(test)]
mod room;
#[cfg(test)]
mod rules;
#[cfg(test)]
mod search;
#[cfg(test)]
mod selection;
#[cfg(test)]
mod service;
#[cfg(test)]
mod speed;
#[cfg(test)]
mod store;
