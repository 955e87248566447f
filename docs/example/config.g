; config.g of RepRapFirmware: a Hangprinter, its anchors by tape measure
M669 K6 A0:-1620:-130 B1310:1270:-120 C-1410:710:-120 D0:0:2300 ; anchors, mm
M666 U2:2:2:4                       ; mechanical advantages
M666 W2.0                           ; mover, kg
M666 Y2920:3030:2890:0              ; wire beyond each anchor, mm
M666 I5:5:5:5                      ; smallest planned force, N
M666 X60:60:60:60                   ; largest planned force, N
