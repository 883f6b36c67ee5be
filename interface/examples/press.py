# SPDX-License-Identifier: GPL-3.0-or-later
"""Presses half the tool's radius into a scene, along -z and back, and plots the force over the depth of the device.

    python3 press.py SCENE.toml [FIGURE.svg]
"""
import sys

import hybrid
import numpy as np

WIDTH, HEIGHT, MARGIN = 640, 400, 60  # of the figure (pixels)


def points(depth_mm: np.ndarray, force_N: np.ndarray) -> str:
    """A line of the figure: the largest depth and force touch its edges."""
    x = MARGIN + (WIDTH - 2 * MARGIN) * depth_mm / depth_mm.max()
    y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * force_N / force_N.max()
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))


def figure(depth_mm: np.ndarray, force_N: np.ndarray) -> str:
    right, bottom = WIDTH - MARGIN, HEIGHT - MARGIN
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif">
<rect width="100%" height="100%" fill="white"/>
<path d="M{MARGIN},{MARGIN} V{bottom} H{right}" fill="none" stroke="black"/>
<polyline points="{points(depth_mm, force_N)}" fill="none" stroke="#1f77b4" stroke-width="2"/>
<text x="{right}" y="{bottom + 20}" text-anchor="end">{depth_mm.max():.1f}</text>
<text x="{MARGIN - 5}" y="{MARGIN}" text-anchor="end">{force_N.max():.2f}</text>
<text x="{WIDTH / 2}" y="{HEIGHT - 15}" text-anchor="middle">depth of the device (mm)</text>
<text x="15" y="{HEIGHT / 2}" text-anchor="middle" transform="rotate(-90 15 {HEIGHT / 2})">force (N)</text>
</svg>
"""


def main() -> None:
    with hybrid.Session(sys.argv[1]) as session:
        top = session.high_m[2] + session.tool_radius_m
        bottom = top - session.tool_radius_m / 2
        z = np.concatenate([np.linspace(top, bottom, 500), np.full(200, bottom), np.linspace(bottom, top, 500)])
        trace = session.play(np.column_stack([np.zeros_like(z), np.zeros_like(z), z]))
    depth_mm, force_N = 1e3 * (top - trace.device_m[:, 2]), np.linalg.norm(trace.force_N, axis=1)
    deepest = np.argmax(depth_mm)
    print(f"{force_N.max():.3f} N at most; {force_N[deepest]:.3f} N at {depth_mm[deepest]:.1f} mm")
    if len(sys.argv) > 2:
        with open(sys.argv[2], "w", encoding="utf-8") as file:
            file.write(figure(depth_mm, force_N))


if __name__ == "__main__":
    main()
