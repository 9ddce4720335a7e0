# Round trip over size, per port.  Run in the folder of channels.csv.
reset
set encoding utf8
set datafile separator comma
set datafile columnheaders
set border 3 linecolor '#404040'
set tics nomirror out scale 0.6
set grid linetype 1 linewidth 0.7 linecolor '#c0c0c0'
set key below center horizontal reverse Left samplen 2
set title 'Round trip of a message: median, and from the least on'
set xlabel 'octets'
set ylabel 'us'
set logscale xy
set format y '%g'
set xrange [32:32768]
set xtics (64, 256, 1024, 4096, 16384)
of(port) = sprintf("<awk -F, 'NR == 1 || $1 == \"%s\"' channels.csv", port)
draw = "plot for [i = 1:3] of(word('loop threads lcm', i)) \
    using 'octets':'trip_median_us':'trip_least_us':'trip_median_us' \
    with yerrorlines linewidth 1.6 pointtype 7 \
    linecolor rgb word('#0072b2 #d55e00 #009e73', i) \
    title word('loop threads lcm', i)"
set terminal pngcairo size 1200,800 font 'DejaVu Sans,13' background '#ffffff'
set output 'latency.png'
eval draw
set terminal svg size 1200,800 font 'DejaVu Sans,sans-serif,13' background '#ffffff'
set output 'latency.svg'
eval draw
