//! The ring model against closed forms, the elastica, conservation laws, its order of convergence, and slow obvious code.

#[cfg(test)]
mod cantilever;
#[cfg(test)]
mod comparison;
#[cfg(test)]
mod compression;
#[cfg(test)]
mod dynamics;
#[cfg(test)]
mod elastica;
#[cfg(test)]
mod element;
#[cfg(test)]
mod extremes;
#[cfg(test)]
mod implicit;
#[cfg(test)]
mod plain;
#[cfg(test)]
mod release;
#[cfg(test)]
mod scenes;
#[cfg(test)]
mod vibration;
