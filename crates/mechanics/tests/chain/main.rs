//! The chain model against closed forms, conservation laws, its order of convergence, and the derived numbers of the
//! experiment.

#[cfg(test)]
mod conservation;
#[cfg(test)]
mod convergence;
#[cfg(test)]
mod drives;
#[cfg(test)]
mod extremes;
#[cfg(test)]
mod far_striker;
#[cfg(test)]
mod grounded;
#[cfg(test)]
mod ladder;
#[cfg(test)]
mod linear;
#[cfg(test)]
mod paper;
#[cfg(test)]
mod scenes;
#[cfg(test)]
mod sensitivities;
#[cfg(test)]
mod transition;
#[cfg(test)]
mod waves;
