//! A designed drive in another scalar, number by number and by name: so a recorder gets its constants.

use core::marker::PhantomData;

use super::block::Block;
use super::encoder::Sensor;
use super::law::{EncoderForm, FastGains, Row};
use crate::real::Real;

/// The name of a number of a design: in the formulas, with its encoder and its place in a row from 1; 0 for none.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberName {
    /// In the formulas.
    pub name: &'static str,
    /// Encoder, or 0.
    pub encoder: usize,
    /// Place in a row, or 0.
    pub entry: usize,
}

impl<T: Real, M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    EncoderForm<T, M, A, E, N, S, FAST, LATE>
{
    /// The same drive in another scalar, with a model that is in it already.
    #[doc(hidden)]
    pub fn converted<U: Real, V>(
        &self,
        model: V,
        to: &mut dyn FnMut(NumberName, T) -> U,
    ) -> EncoderForm<U, V, A, E, N, S, FAST, LATE> {
        let mut of = |name, encoder, entry, number| to(NumberName { name, encoder, entry }, number);
        let blocks = core::array::from_fn(|i| {
            let Block { lambda, phi, g2, g1, h1, gains } = self.blocks[i];
            Block {
                lambda: of("lambda", i + 1, 0, lambda),
                phi: of("phi", i + 1, 0, phi),
                g2: of("g2", i + 1, 0, g2),
                g1: of("g1", i + 1, 0, g1),
                h1: of("h1", i + 1, 0, h1),
                gains: core::array::from_fn(|s| of("gain", i + 1, s + 1, gains[s])),
            }
        });
        let sensors = core::array::from_fn(|i| {
            let Sensor { unit, half_span, edge, unread, beyond, base_counts, base_turns } = self.sensors[i];
            Sensor {
                unit: of("unit", i + 1, 0, unit),
                half_span: of("half_span", i + 1, 0, half_span),
                edge: of("edge", i + 1, 0, edge),
                unread,
                beyond,
                base_counts,
                base_turns,
            }
        });
        let fast = core::array::from_fn(|f| {
            core::array::from_fn(|i| {
                let FastGains { more, calm, rate, smoothing, keep } = self.fast[f][i];
                FastGains {
                    more: core::array::from_fn(|s| of("more", i + 1, s + 1, more[s])),
                    calm: of("calm", i + 1, 0, calm),
                    rate: of("rate", i + 1, 0, rate),
                    smoothing: of("smoothing", i + 1, 0, smoothing),
                    keep: of("keep", i + 1, 0, keep),
                }
            })
        });
        let gate = core::array::from_fn(|i| of("gate", i + 1, 0, self.gate[i]));
        let inertia = core::array::from_fn(|i| of("inertia", i + 1, 0, self.inertia[i]));
        let Row { c, kx, c_d, c_growth, k_d, k_growth, k_last, feed, kw, us, k_offset, .. } = self.row;
        let Row { decay, per_b, period, turn, u_min, u_max, plausible, hold, fallback, .. } = self.row;
        let mut per_block = |name, row: [T; E]| core::array::from_fn(|i| of(name, i + 1, 0, row[i]));
        let [c_d, c_growth, k_d, k_growth] =
            [("c_d", c_d), ("c_growth", c_growth), ("k_d", k_d), ("k_growth", k_growth)]
                .map(|(name, row)| per_block(name, row));
        let mut of = |name, entry, number| of(name, 0, entry, number);
        let row = Row {
            c: core::array::from_fn(|j| of("c", j + 1, c[j])),
            kx: core::array::from_fn(|j| of("kx", j + 1, kx[j])),
            c_d,
            c_growth,
            k_d,
            k_growth,
            k_last: of("k_last", 0, k_last),
            feed: core::array::from_fn(|j| of("feed", j + 1, feed[j])),
            kw: of("kw", 0, kw),
            us: of("us", 0, us),
            k_offset: of("k_offset", 0, k_offset),
            decay: of("decay", 0, decay),
            per_b: of("per_b", 0, per_b),
            period: of("period", 0, period),
            turn: of("full_turn", 0, turn),
            u_min: of("u_min", 0, u_min),
            u_max: of("u_max", 0, u_max),
            plausible: of("plausible", 0, plausible),
            hold: of("hold", 0, hold),
            fallback: of("fallback", 0, fallback),
        };
        let (closing, lost_ticks) = (of("closing", 0, self.closing), of("lost_ticks", 0, self.lost_ticks));
        let at_rest = self.at_rest;
        EncoderForm { model, blocks, sensors, fast, row, gate, closing, lost_ticks, inertia, at_rest, of: PhantomData }
    }
}
