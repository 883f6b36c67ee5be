// SPDX-License-Identifier: GPL-3.0-or-later
// The vibrations that a hand feels: the spectrum of a motion against the threshold of the skin.
#pragma once

#include <span>

namespace hybrid {

// The least amplitude (m) at which a sinusoid is felt, after the thesis's table of human limits. Below 30 Hz
// it is 28 dB above 1 µm (25 µm). From there it falls by 12 dB an octave to 300 Hz (0.25 µm). At 250 Hz, the
// best frequency that the table names, it is 0.36 µm. Up to 1 kHz, where the table ends, it stays as at 300
// Hz. Above, nothing is felt (infinity).
[[nodiscard]] double vibration_threshold_m(double frequency_hz) noexcept;

struct Vibration {
  double frequency_hz = 0.0;
  double amplitude_m = 0.0;
  double felt = 0.0;  // amplitude / threshold; felt if above 1
};

// The sinusoid in a motion that is felt most. Frequencies are k·rate/samples, from k = 4 (8 Hz for half a
// second of motion) to 1 kHz or half the rate. Mean and steady drift are removed. Then Hann's window and a
// discrete Fourier transform are applied. The amplitude is that of the three lines that a sinusoid fills, so
// it is right for any frequency between lines. Cost: samples · lines. Fewer than 16 samples give no
// vibration.
[[nodiscard]] Vibration strongest_vibration(std::span<const double> motion_m, double rate_hz);

}  // namespace hybrid
