# Vogmap on Debian 12: docker build -t vogmap . && docker run --rm -it --cap-add NET_ADMIN -p 7680:7680 vogmap
# NET_ADMIN: LCM wants a multicast route, which tools/multicast adds where there is none.
FROM debian:12 AS build
COPY . /vogmap
WORKDIR /vogmap
RUN tools/setup && tools/build release && cpack --config build/CPackConfig.cmake -B /package

FROM debian:12
COPY --from=build /package/*.deb /tmp/
RUN apt-get update && apt-get install -y /tmp/*.deb iproute2 && rm -rf /var/lib/apt/lists/* /tmp/*.deb
COPY tools/multicast /usr/share/vogmap/multicast
EXPOSE 7680
CMD ["/bin/sh", "-c", ". /usr/share/vogmap/multicast && exec bash"]
