// SPDX-License-Identifier: GPL-3.0-or-later
// Which vibrations a hand feels: the spectrum of a motion, against the threshold of the skin.
#pragma once

#include <span>

namespace hybrid {

// The least amplitude of a sinusoid that is felt (m), after the thesis's table of human limits: 28 dB above
// 1 µm (25 µm) below 30 Hz, then −12 dB an octave to 300 Hz (0.25 µm; 0.36 µm at 250 Hz, the best frequency
// of those it names), and as there up to 1 kHz, where the table ends. Infinity above: not felt.
[[nodiscard]] double vibration_threshold_m(double frequency_hz) noexcept;

struct Vibration {
  double frequency_hz = 0.0;
  double amplitude_m = 0.0;
  double felt = 0.0;  // amplitude / threshold: above 1 it is felt
};

// The most felt sinusoid in a motion sampled at `rate_hz`, at frequencies k·rate/samples from k = 4 (so half
// a second of motion is asked from 8 Hz on) to 1 kHz or half the rate. Mean and even drift are taken out,
// then Hann's window and a discrete Fourier transform; an amplitude is that of the three lines a sinusoid
// fills, so it is right at any frequency between them. Cost: samples · lines. Fewer than 16 samples feel like
// nothing.
[[nodiscard]] Vibration strongest_vibration(std::span<const double> motion_m, double rate_hz);

}  // namespace hybrid
