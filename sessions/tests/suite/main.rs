//! Sessions through the crate's public door: written, damaged, read back, exported.

#[cfg(test)]
mod beside;
#[cfg(test)]
mod catalog;
#[cfg(test)]
mod damage;
#[cfg(test)]
mod disk;
#[cfg(test)]
mod exports;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod foreign;
#[cfg(test)]
mod foreign_damage;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod killed;
#[cfg(test)]
mod lake;
#[cfg(test)]
mod limits;
#[cfg(test)]
mod pace;
#[cfg(test)]
mod power;
#[cfg(test)]
mod recovery;
#[cfg(test)]
mod round_trip;
#[cfg(test)]
mod segments;
#[cfg(test)]
mod support;
#[cfg(test)]
mod worker;
#[cfg(test)]
mod written_again;
