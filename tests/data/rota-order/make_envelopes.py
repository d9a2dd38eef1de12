import numpy as np
from rota.extract import order_waveform

rate = 2048.0
time = np.arange(8 * 2048) / rate
rpm = 900 + 225 * time
turned = (900 * time + 112.5 * time**2) / 60
frequency = 1.5 * rpm / 60
main = 2j / (1 - (frequency / 42) ** 2 + 0.12j * frequency / 42)
record = (
    np.real(main * np.exp(3j * np.pi * turned))
    + 0.5 * np.cos(np.pi * turned + 1)
    + np.cos(6 * np.pi * turned - 0.4)
    + 0.3 * np.cos(2 * np.pi * 50 * time)
)
envelopes = order_waveform(record, rate, rpm, [0.5, 1.5, 3.0], bandwidth=3.0).envelopes
rows = slice(0, None, 400)
table = np.column_stack([time[rows], envelopes[rows].real, envelopes[rows].imag])
header = "time [s],re 0.5,re 1.5,re 3,im 0.5,im 1.5,im 3"
np.savetxt("envelopes.csv", table, delimiter=",", header=header, comments="", fmt="%.12g")
