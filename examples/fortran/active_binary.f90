! Example: a binary mixture of chemically active particles that pair up. A makes a substance that B
! consumes; each moves in the other's field, F_i = mobility_i sum_k alpha_k r_ik/|r_ik|**3, so that
! like particles part and unlike ones meet. Action is not reaction: a bound pair swims.
program active_binary
   use, intrinsic :: iso_fortran_env, only: real64
   use gamboge
   implicit none
   integer, parameter :: particles = 512, steps = 300
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   type(gbg_engine_t) :: engine
   real(real64) :: x(2, particles), f(2, particles), lengths(2), error, relative
   integer :: species(particles)

   call context%create('auto')
   call make_scene()
   call engine%create(scene)
   call engine%get_species(species)
   call engine%get_box(lengths)

   call engine%get_positions(x)
   print '(a,1x,i0)', 'particles', particles
   print '(a,1x,f14.9)', 'gap_at_start', mean_gap()
   call engine%run(steps)
   call engine%get_positions(x)
   print '(a,1x,f14.9)', 'gap_at_end', mean_gap()

   ! The sum of all forces is not 0; the library measures the error of the forces itself.
   call engine%get_forces(f)
   call engine%force_error(error, relative)
   print '(a,1x,f14.6)', 'sum_of_forces', norm2(sum(f, dim=2))
   print '(a,1x,i0)', 'force_error_below_1e-5', merge(1, 0, error < 1e-5_real64)
   call print_hash()

   call engine%destroy()
   call scene%destroy()
   call context%destroy()

contains

   subroutine make_scene()
      call scene%create(context, 2)
      call scene%set('particles.count', particles)
      call scene%add_species('A', 1.0_real64, 1.0_real64, 1.0_real64, fraction=0.5_real64)
      call scene%add_species('B', 1.0_real64, -1.0_real64, -2.0_real64, fraction=0.5_real64)
      call scene%add_force(2.0_real64, 'minimum_image')
      call scene%set('box.packing', 0.52_real64)
      call scene%set('particles.start.lattice', 'triangular')
      call scene%set('particles.start.jitter', 0.5_real64)
      call scene%set('excluded_volume.rule', 'auto')
      call scene%set('dynamics.dt', 0.01_real64)
      call scene%set('dynamics.temperature', 0.01_real64)
      call scene%set('run.seed', 11)
   end subroutine make_scene

   ! Mean distance from the surface of an A to that of the nearest B.
   function mean_gap() result(gap)
      real(real64) :: gap, nearest, r(2)
      integer :: i, k
      gap = 0
      do i = 1, particles
         if (species(i) /= 1) cycle
         nearest = huge(nearest)
         do k = 1, particles
            if (species(k) /= 2) cycle
            r = x(:, i) - x(:, k)
            r = r - lengths*anint(r/lengths)
            nearest = min(nearest, norm2(r))
         end do
         gap = gap + (nearest - 1)/count(species == 1)
      end do
   end function mean_gap

   subroutine print_hash()
      character(:), allocatable :: hash
      call engine%hash(hash)
      print '(a,1x,a)', 'hash', hash
   end subroutine print_hash
end program active_binary
