//! Queries, contacts and forces against exhaustive search.

mod answers;
mod chain;
mod contacts;
mod differential;
mod flat;
mod hand;
mod interval;
mod kernels;
mod paper_search;
mod positions;
mod proxy;
mod refusals;
mod roots;
mod rows;
mod shown_budgets;
mod side;
mod slack;
mod solids;
mod swept;
mod ties;
mod tracked_chain;
mod tracked_contacts;
mod tracked_depth;
mod tracker;
mod walls;
mod wide;
