// SPDX-License-Identifier: MIT
#include "diagnostics/findings/kinds.hpp"

namespace resonid::diagnostics::detail {
namespace {

constexpr FindingKind kData[] = {
    {"no-excitation", "No excitation", "identify, inspect, track", TrustEffect::may_withdraw,
     "The input is constant, or (track) the excitation around the resonance was too weak for part of the "
     "time.",
     "A response cannot be measured where nothing excites the machine. Track freezes the estimate there.",
     "Check that the right column is the input, and excite throughout the recording."},
    {"dead-output", "Constant output", "identify, inspect", TrustEffect::withdraws,
     "The output does not change at all.", "The wrong signal was recorded, or the sensor is dead.",
     "Choose the column of the measured motion (`.output`), or check the sensor."},
    {"outlier", "Outliers", "identify, inspect", TrustEffect::withdraws,
     "One or a few samples lie far from all others.",
     "A transmission or conversion error. A single such sample spoils every frequency.",
     "Remove it, or cut the recording (`.from_s`, `.to_s`)."},
    {"stuck-output", "Output stood still", "identify, inspect", TrustEffect::withdraws,
     "The output repeats one value over many samples while the input goes on.",
     "The measurement stopped being updated, so that stretch is not the machine's answer.",
     "Take a part without it (`.from_s`, `.to_s`)."},
    {"limited-output", "Clipped output", "identify, inspect", TrustEffect::withdraws,
     "The output stays at its largest or smallest value for part of the time.",
     "The measurement's range is too small. A clipped signal is no linear response.",
     "Excite less, move more slowly, or widen the measuring range."},
    {"position-jumps", "Jumps of the position", "identify, inspect", TrustEffect::withdraws,
     "The position jumps by most of its span from one sample to the next, by amounts that do not agree.",
     "A counter was set anew, lost counts, or wraps around at a number that its jumps do not show.",
     "Give `.counts_per_rev` if it wraps around there, or take a part between two jumps (`.from_s`, "
     "`.to_s`)."},
    {"saturation", "Saturated input", "identify, inspect", TrustEffect::may_withdraw,
     "The input stays at its limit for part of the time.",
     "A torque or current limit acts: the drive is not linear there.", "Reduce the amplitude."},
    {"gaps", "Gaps in the time stamps", "identify, inspect", TrustEffect::withdraws,
     "The time stamps jump: samples are missing.",
     "What follows a gap comes too early, so phases and frequencies are wrong.",
     "Take a part without gaps, or record without losses."},
    {"filled-samples", "Interpolated samples", "identify, inspect, track", TrustEffect::keeps,
     "Isolated samples were missing and were interpolated.",
     "A short loss of data. High frequencies are slightly falsified around them.",
     "Record without losses; `.missing refuse` rejects such a recording."},
    {"jitter", "Jitter of the time stamps", "identify, inspect, track", TrustEffect::keeps,
     "The time stamps differ from a uniform grid.",
     "If the samples were really taken so unevenly, high frequencies are blurred; if only the stamps are "
     "uneven, nothing is wrong.",
     "Sample by a timer, or record the true times."},
    {"dropped-samples", "Samples missing without a trace", "identify", TrustEffect::withdraws,
     "The output runs ahead of its simulation by one step again and again, though the time stamps show "
     "nothing.",
     "The recorder dropped samples and numbered the rest as if they were all. Frequencies and inertias come "
     "out wrong.",
     "Record without losses, or with the times at which the samples were taken."},
    {"repeated-samples", "Samples doubled without a trace", "identify", TrustEffect::withdraws,
     "The output falls behind its simulation by one step again and again.",
     "The recorder wrote samples twice. Frequencies and inertias come out wrong.",
     "Record without doubling, or with the times at which the samples were taken."},
    {"disturbed-samples", "Disturbed samples", "identify", TrustEffect::withdraws,
     "More samples than noise allows lie many standard deviations off the model.",
     "Missing or doubled samples, impacts, load steps, or behaviour that the model lacks.",
     "Take a part without them (`.from_s`, `.to_s`)."},
    {"held-output", "Output renewed in every n-th sample", "identify", TrustEffect::keeps,
     "The measured output changes in every second, third ... sample only.",
     "The drive updates the value more slowly than it was recorded. Models are fitted to the new values.",
     "Record at the rate of the measurement where that is possible."},
    {"low-coherence", "Low coherence", "identify, inspect", TrustEffect::keeps,
     "The coherence is low in a band.",
     "Little excitation, much noise or a non-linear drive there; around an anti-resonance it is natural.",
     "Do not read resonances from that band; excite it more strongly."},
    {"incoherent", "No coherent response", "identify, inspect", TrustEffect::may_withdraw,
     "Hardly any line of the response is coherent.",
     "Noise or motion outweighs the response, or the output is no response to this input (wrong column).",
     "Check the columns (`.input`, `.output`), or excite more strongly."},
    {"weak-excitation", "Excitation too weak for the noise", "identify", TrustEffect::withdraws,
     "Noise is as large as what the excitation makes: in a loop most of the input's power is the "
     "controller's "
     "answer to the noise of the output, or hardly any line of the response rises above its standard "
     "deviation.",
     "Of noise that a controller feeds back averages show minus the inverse of the controller, with high "
     "coherence, and no machine. No model is shown where noise is most of a typical line.",
     "Excite more strongly or longer in the band named, and record the excitation (`.excitation`)."},
    {"unsettled-lines", "Unsettled lines", "identify", TrustEffect::keeps,
     "Some tracked lines had not settled when the recording ended.",
     "The recording is too short for the number of lines.", "Record longer, or track fewer lines."},
    {"non-linear-distortion", "Non-linear distortion", "identify", TrustEffect::keeps,
     "The drive responds at lines that are not excited, or differently to different realisations.",
     "Friction, saturation, play or a stiffening spring. The response is valid for excitations of this "
     "amplitude.",
     "Excite as strongly as the machine is used, or preload it."},
    {"not-physical-units", "Units are not physical", "identify", TrustEffect::keeps,
     "Input and output are not a torque (force) and a motion.",
     "The coefficients are in the units of the columns and are not inertias and stiffnesses. Resonances are "
     "right.",
     "Give `.input_scale` and `.output_scale`, or the units."},
};

constexpr FindingKind kLoop[] = {
    {"other-quantity", "Other quantity than specified", "identify", TrustEffect::withdraws,
     "The output behaves like a position, velocity or acceleration other than the specified one.",
     "A name or a unit was misread, or `.output_quantity` is wrong. Every parameter would be wrong.",
     "Give `.output_quantity`."},
    {"reversed", "Reversed sign or exchanged columns", "identify", TrustEffect::withdraws,
     "At low frequencies the response leads by 90 degrees instead of lagging.",
     "The sign of encoder or torque is reversed, or input and output are exchanged.",
     "Try `.output_scale -1`, or exchange `.input` and `.output`."},
    {"input-ahead", "Output ahead of a zero-order hold", "identify", TrustEffect::keeps,
     "The output comes earlier than a zero-order hold at the input allows.",
     "The input is a measured torque, not a commanded one. The model takes that into account.",
     "Nothing, unless a controller is to be designed: `tune` needs the delay of the whole chain, so identify "
     "with "
     "the commanded torque as `.input`."},
    {"further-delay", "Additional delay", "identify, track", TrustEffect::keeps,
     "The recording shows more or less delay than the one given.",
     "Computation, bus or filter delay beyond the one given. It is part of the model and of the margins.",
     "Check the delay given."},
    {"feedback-bias", "Bias by feedback", "identify, validate", TrustEffect::may_withdraw,
     "A controller feeds the output's noise back to the input.",
     "Averaged spectra of input and output are biased towards minus the inverse of the controller.",
     "Record the excitation, or give the controller and the reference, or let a model be fitted."},
    {"controller-differs", "Controller differs", "identify, track", TrustEffect::may_withdraw,
     "Input and output show another controller than the one given.",
     "Other gains ran, or the controller was fed another signal than the recorded one. The margins are not "
     "those of the loop.",
     "Give the controller that ran (`.controller`), or leave it out."},
    {"spring-to-ground", "Spring to ground", "identify", TrustEffect::may_withdraw,
     "At low frequencies the machine is held: the velocity leads and grows with frequency.",
     "A flexure, gravity, a gas spring or a position loop ties the machine to the ground.",
     "Give `.ground motor` or `.ground load`, or open the position loop."},
    {"ground-side", "Side of the ground spring not determined", "identify", TrustEffect::withdraws,
     "A spring to the ground fits at either side of the coupling.",
     "Both models have the same response, with other load inertia and stiffness.",
     "Say which side it is (`.ground`)."},
    {"crossover-outside-band", "Crossover outside the excited band", "identify", TrustEffect::keeps,
     "The loop crosses over far outside the excited band.",
     "The identified controller is extrapolated there, so the margins have no error bars.",
     "Give `.controller`, or excite down to the crossover."},
    {"margins-beyond-band", "Margins beyond the excited band", "identify", TrustEffect::keeps,
     "Some margins lie above the excited band.",
     "Only the model describes the loop there: a mode that the recording does not show would change them.",
     "Excite up to those frequencies."},
    {"unstable-loop", "Unstable loop", "identify", TrustEffect::keeps,
     "The phase margin is zero or negative.",
     "Since the loop ran, the controller, delay or sign given does not belong to this recording.",
     "Give the right controller, delay and signs."},
    {"planned-unstable", "Unstable with the planned controller", "identify", TrustEffect::keeps,
     "With the planned controller the loop is unstable on the identified machine.",
     "The planned gains are too high for the machine and its delay, or in other units.",
     "Do not run it; `tune` designs one that holds its margins."},
    {"planned-may-be-unstable", "Perhaps unstable with the planned controller", "identify",
     TrustEffect::keeps,
     "With the planned controller the smallest distance of the loop to -1 is within two of its standard "
     "deviations.",
     "The loop is stable on the identified machine, but the true one may differ enough from it to make it "
     "unstable.",
     "Do not run it; lower its gain, or identify more precisely, a delay that was only told too."},
    {"planned-small-margins", "Small margins with the planned controller", "identify", TrustEffect::keeps,
     "With the planned controller the smallest phase margin is below 30 degrees, or the smallest distance to "
     "-1 below 0.5.",
     "The loop is close to oscillating; the least margin need not be that at the first crossover.",
     "Lower its gain; `tune` designs one that holds its margins."},
    {"planned-not-judged", "Stability with the planned controller not told", "identify", TrustEffect::keeps,
     "The lines of the response do not tell whether the loop is stable with the planned controller.",
     "Without a drive model stability is read from L at the lines: it must be above 1 at the first, below "
     "the "
     "first anti-resonance, at most 1/2 at the last (1/50 where that is below a resonance), and "
     "the "
     "lines dense where it passes -1. Margins are not known otherwise.",
     "Identify with a drive model, or excite the band around the planned crossover, and beyond the "
     "resonances."},
    {"small-phase-margin", "Small phase margin", "identify", TrustEffect::keeps,
     "The smallest phase margin is below 30 degrees.", "The loop is close to oscillating.",
     "Lower the gain or the delay."},
    {"small-modulus-margin", "Small modulus margin", "identify", TrustEffect::keeps,
     "The minimum distance of the loop to -1 is small (Ms is large).",
     "Disturbances around that frequency are amplified.",
     "Lower the gain, or damp the resonance by a notch or a filter."},
    {"several-crossovers", "Several crossovers", "identify", TrustEffect::keeps,
     "The loop gain falls below 1 at several frequencies.",
     "A resonance lifts the loop above 1 again. The phase margin at the first crossover is not the smallest.",
     "Judge the loop by the smallest phase margin and the modulus margin."},
};

}  // namespace

std::span<const FindingKind> data_kinds() noexcept { return kData; }
std::span<const FindingKind> loop_kinds() noexcept { return kLoop; }

}  // namespace resonid::diagnostics::detail
