! Trajectories through the module: written by an engine, read back in every form; restart files.
program trajectory
   use, intrinsic :: iso_fortran_env, only: int64, real32, real64
   use checking, only: check, check_close, check_text, finish
   use gamboge
   implicit none
   integer, parameter :: n = 30
   character(*), parameter :: path = 'trajectory_test.nc', restart = 'trajectory_test.restart'
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   type(gbg_engine_t) :: engine
   type(gbg_trajectory_t) :: file
   real(real64) :: last(2, n), unwrapped(2, n)
   character(:), allocatable, save :: hash
   character(300) :: errmsg
   integer :: stat

   call context%create('cpu')
   call make()
   call engine%create(scene)
   call file%create(engine, path, stat, errmsg)
   if (.not. gbg_has_component('netcdf')) then
      call check(stat == gbg_e_unbuilt .and. index(errmsg, 'GBG_WITH_NETCDF') > 0, &
                 'without netCDF: '//trim(errmsg))
      call finish()
      stop
   end if
   call check(stat == gbg_ok, 'create: '//trim(errmsg))
   call file%append(engine)
   call engine%run(40)
   call file%append(engine)
   call engine%save(restart)
   call engine%run(40)
   call file%append_begin(engine)
   call file%append_end()
   call file%destroy()
   call engine%get_positions(last)
   call engine%get_positions(unwrapped, wrapped=.false.)
   call engine%hash(hash)

   call read_back()
   call go_on()
   call refusals()
   call finish()

contains

   subroutine make()
      real(real64) :: x(2, n)
      integer :: i
      do i = 1, n
         x(:, i) = [2.0_real64*modulo(i - 1, 6) - 5, 1.8_real64*floor((i - 1)/6.0) + 1.5_real64]
      end do
      call scene%create(context, 2)
      call scene%set_box([12.0_real64, 9.0_real64], origin=[-6.0_real64, 1.0_real64])
      call scene%add_species('small', 0.5_real64, 0.0_real64, 1.0_real64)
      call scene%add_species('large', 1.0_real64, 0.0_real64, 1.0_real64)
      call scene%add_particles(x, species=[(1 + modulo(i - 1, 2), i=1, n)])
      call scene%set('excluded_volume.rule', 'bounce')
      call scene%set('dynamics.dt', 0.01_real64)
      call scene%set('dynamics.temperature', 1.0_real64)
      call scene%set('output.trajectory.unwrapped', .true.)
      call scene%set('output.trajectory.overlap', .true.)
   end subroutine make

   subroutine read_back()
      integer :: frames, particles, n_species, species(n), images(2, n)
      integer(int64) :: step, long_frames, long_particles
      real(real64) :: x(2, n), deep(3, n), rx(n), ry(n), time, lengths(2), origin(2), diameter(n)
      real(real32) :: single(2, n)
      logical :: flags(n), now(n), is_double, is_hard
      character(:), allocatable :: name
      call file%open(context, path)
      call file%get_size(frames, particles, n_species)
      call file%get_size(long_frames, long_particles)
      call check(frames == 3 .and. particles == n .and. n_species == 2, 'sizes')
      call check(long_frames == 3 .and. long_particles == n, 'sizes, int64')
      call check(file%dimension() == 2, 'dimension')
      call file%is_double(is_double)
      call check(is_double, 'double precision')
      call file%is_hard(is_hard)
      call check(is_hard, 'hard cores')
      call file%get_species(species)
      call check(all(species(1::2) == 1) .and. all(species(2::2) == 2), 'species')
      call file%get_diameters(diameter)
      call check_close(diameter(2), 1.0_real64, 0.0_real64, 'diameter')
      call file%species_name(2, name)
      call check_text(name, 'large', 'species name')
      call file%get_frame(3, time, step, lengths, origin)
      call check_close(time, 0.8_real64, 1e-12_real64, 'time')
      call check(step == 80, 'step')
      call check_close(lengths(2), 9.0_real64, 0.0_real64, 'box length')
      call check_close(origin(1), -6.0_real64, 0.0_real64, 'origin')
      call file%get_positions(3, x)
      call check_close(maxval(abs(x - last)), 0.0_real64, 1e-12_real64, 'positions')
      call file%get_images(3, images)
      call check_close(maxval(abs(x + images*spread(lengths, 2, n) - unwrapped)), 0.0_real64, &
                       1e-12_real64, 'unwrapped positions')
      deep = -9
      call file%get_positions(3_int64, deep)
      call check(maxval(abs(deep(:2, :) - x)) <= 0 .and. all(deep(3, :) < -8), 'x(3,n) in 2D')
      call file%get_positions(3, rx, ry)
      call check(maxval(abs(rx - x(1, :)) + abs(ry - x(2, :))) <= 0, 'separate')
      call file%get_positions(3, single)
      call check(maxval(abs(single - x)) < 1e-6, 'single precision')
      call file%get_overlapped(3, flags)
      call engine%get_overlapped(now)
      call check(all(flags .eqv. now), 'overlap flags')
      call file%destroy()
   end subroutine read_back

   ! From the restart file the same end is reached; frames after it are replaced.
   subroutine go_on()
      type(gbg_engine_t) :: second
      character(:), allocatable :: again
      integer :: frames, particles
      call second%create(scene)
      call second%load(restart)
      call file%continue(second, path)
      call file%get_size(frames, particles)
      call check(frames == 2, 'frames after the restart are cut off')
      call second%run(40)
      call file%append(second)
      call file%destroy()
      call second%hash(again)
      call check_text(again, hash, 'same end after a restart')
   end subroutine go_on

   subroutine refusals()
      real(real64) :: x(2, n)
      call file%open(context, 'no_such_file.nc', stat, errmsg)
      call check(stat == gbg_e_file .and. index(errmsg, 'no_such_file.nc') > 0, &
                 'no file: '//trim(errmsg))
      call file%open(context, path)
      call file%get_positions(0, x, stat)
      call check(stat == gbg_e_argument, 'frame 0')
      call file%get_positions(4, x, stat)
      call check(stat == gbg_e_argument, 'frame 4 of 3')
      call file%get_positions(1, x(:, :n - 1), stat)
      call check(stat /= gbg_ok, 'too small an array')
      call file%open(context, path, stat)
      call check(stat == gbg_e_order, 'open twice')
      call file%destroy()
   end subroutine refusals
end program trajectory
