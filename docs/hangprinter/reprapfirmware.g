; config: line fitted at 2000 mm, tested from 3.17 to 24.66 N.
; The firmware knows no creep; creep-table.csv says how much a line grows under load.
M669 K6 A-4.19:-1629.43:-131.21 B1313.17:1277.68:-120.04 C-1416.31:705.72:-115.64 D9.72:0.30:2290.60 ; anchors, mm
M666 U2:2:2:4 ; mechanical advantages
M666 W2 ; mover, kg
M666 S5002 ; spring constant per unit length, N: 90 % interval 4973 to 5032
M666 Y2920:3030:2890:0 ; wire beyond each anchor, mm
M666 I5:5:5:5 ; smallest planned force, N
M666 X60:60:60:60 ; largest planned force, N
