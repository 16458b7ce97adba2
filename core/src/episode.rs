//! An episode: scene, policy and seed, and the sequence of decisions, observations, beliefs and scores; a state
//! machine that is driven one action at a time, and the directory that it is written to, step by step.
