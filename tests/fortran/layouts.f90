! The same particles in every layout make the same engine, and come back in every layout.
module layouts_parts
   use, intrinsic :: iso_fortran_env, only: int32, int64, real64
   use checking, only: check, check_text
   use gamboge
   implicit none
   integer, parameter :: n = 20
   real(real64), parameter :: edge = 10
   character(:), allocatable :: wanted

   type :: atom
      integer(int32) :: species
      real(real64) :: at(3)
   end type atom

contains

   subroutine start(context, dimension, scene)
      type(gbg_context_t), intent(in) :: context
      integer, intent(in) :: dimension
      type(gbg_scene_t), intent(inout) :: scene
      integer :: i
      call scene%create(context, dimension)
      call scene%set_box([(edge, i=1, dimension)])
      call scene%add_species('A', 0.1_real64, 1.0_real64, 1.0_real64)
      call scene%add_species('B', 0.1_real64, 1.0_real64, -1.0_real64)
      call scene%add_force(2, 'minimum_image')
      call scene%set('dynamics.dt', 0.001_real64)
   end subroutine start

   ! The hash of a scene's start is that of the first scene that came here.
   subroutine same(scene, what)
      type(gbg_scene_t), intent(inout) :: scene
      character(*), intent(in) :: what
      type(gbg_engine_t) :: engine
      character(:), allocatable :: hash
      call engine%create(scene)
      call engine%hash(hash)
      call check(len(hash) == 64, what//': length of a hash')
      if (.not. allocated(wanted)) wanted = hash
      call check_text(hash, wanted, what)
      call engine%destroy()
      call scene%destroy()
   end subroutine same

   ! Coordinates that single precision holds exactly.
   pure function made(dimension) result(x)
      integer, intent(in) :: dimension
      real(real64) :: x(dimension, n)
      integer :: a, i
      do i = 1, n
         do a = 1, dimension
            x(a, i) = 0.25_real64*modulo(7*i*a + a*a + i*i, 40)
         end do
         x(1, i) = 0.5_real64*(i - 1)
      end do
   end function made

   subroutine inputs(context, dimension)
      type(gbg_context_t), intent(in) :: context
      integer, intent(in) :: dimension
      type(gbg_scene_t) :: scene
      type(atom) :: atoms(n)
      real(real64) :: x(dimension, n), deep(3, n), wide(3, 2*n), line(3*n)
      real(real64), allocatable :: z(:)
      integer :: i, species(n)
      integer(int64) :: ids(n)

      if (allocated(wanted)) deallocate (wanted)
      x = made(dimension)
      deep = -1
      deep(:dimension, :) = x
      z = deep(3, :)
      species = [(1 + modulo(i, 2), i=1, n)]
      ids = [(int(i - 1, int64), i=1, n)]
      wide = -2
      wide(:, 1:2*n:2) = deep
      do i = 1, n
         line(3*i - 2:3*i) = deep(:, i)
         atoms(i) = atom(species(i), deep(:, i))
      end do

      call start(context, dimension, scene)
      call scene%add_particles(x, species)
      call same(scene, 'x(d,n)')
      call start(context, dimension, scene)
      call scene%add_particles(deep, species, ids)
      call same(scene, 'x(3,n) with ids')
      call start(context, dimension, scene)
      call scene%add_particles(deep(:dimension, :), int(species, int64))
      call same(scene, 'x(1:d,n), species int64')
      call start(context, dimension, scene)
      call scene%add_particles(wide(:, 1:2*n:2), species)
      call same(scene, 'every second column')
      call start(context, dimension, scene)
      call scene%add_particles(x(:, n:1:-1), species(n:1:-1), ids(n:1:-1))
      call same(scene, 'reversed, told by ids')
      call start(context, dimension, scene)
      call scene%add_particles(deep(1, :), deep(2, :), z, species)
      call same(scene, 'separate, of different strides')
      call start(context, dimension, scene)
      call scene%add_particles(line(1::3), line(2::3), line(3::3), species)
      call same(scene, 'one after the other')
      call start(context, dimension, scene)
      call scene%add_particles(atoms%at(1), atoms%at(2), atoms%at(3), atoms%species)
      call same(scene, 'components of a type')
      call start(context, dimension, scene)
      call scene%add_particles(real(x), species)
      call same(scene, 'single precision')
      call start(context, dimension, scene)
      call scene%add_particles(real(deep(1, :)), real(deep(2, :)), real(z), species)
      call same(scene, 'separate, single precision')
      call start(context, dimension, scene)
      call scene%add_particles(x(:, :7), species(:7))
      call scene%add_particles(x(:, 8:), species(8:))
      call same(scene, 'in two blocks')
   end subroutine inputs

   subroutine outputs(context, dimension)
      type(gbg_context_t), intent(in) :: context
      integer, intent(in) :: dimension
      type(gbg_scene_t) :: scene
      type(gbg_engine_t) :: engine
      real(real64) :: x(dimension, n), y(dimension, n), deep(3, n), wide(3, 2*n), line(3*n), z(n)
      real(real64) :: f(dimension, n), g(3, n)
      real :: single(3, n), single_x(n), single_y(n), single_z(n)
      integer :: species(n), has(n), count, i
      integer(int64) :: ids(n), long_count, long_species(n)
      x = made(dimension)
      species = [(1 + modulo(i, 2), i=1, n)]
      call start(context, dimension, scene)
      call scene%add_particles(x, species)
      call engine%create(scene)
      call engine%get_size(count)
      call engine%get_size(long_count)
      call check(count == n .and. long_count == n, 'number of particles')
      call engine%get_species(has)
      call engine%get_species(long_species)
      call check(all(has == species) .and. all(long_species == species), 'species')
      call engine%get_ids(ids)
      call check(all(ids == [(i - 1, i=1, n)]), 'ids')

      y = -1
      call engine%get_positions(y)
      call near(y, x, 'x(d,n)')
      deep = -1
      call engine%get_positions(deep)
      call near(deep(:dimension, :), x, 'x(3,n)')
      call check(dimension == 3 .or. all(deep(3, :) < 0), 'third row left alone')
      wide = -1
      call engine%get_positions(wide(:, 2*n:1:-2))
      call near(wide(:dimension, 2*n:1:-2), x, 'every second column, reversed')
      call check(all(wide(:, 1::2) < 0), 'the columns between')
      line = -1
      call engine%get_positions(line(1::3), line(2::3), line(3::3))
      call near(reshape(line, [3, n]), x, 'one after the other')
      z = -1
      deep = -1
      call engine%get_positions(deep(1, :), deep(2, :), z)
      deep(3, :) = z
      call near(deep, x, 'different strides')
      single = -1
      call engine%get_positions(single)
      call near(real(single, real64), x, 'single precision')
      single_z = -1
      call engine%get_positions(single_x, single_y, single_z)
      single(1, :) = single_x
      single(2, :) = single_y
      single(3, :) = single_z
      call near(real(single, real64), x, 'separate, single precision')

      call engine%get_forces(f)
      call check(maxval(abs(f)) > 0, 'forces')
      g = -7
      call engine%get_forces(g(1, :), g(2, :), g(3, :))
      call check(maxval(abs(g(:dimension, :) - f)) <= 0, 'forces, separate')
      single = -7
      call engine%get_forces(single)
      call check(maxval(abs(single(:dimension, :) - f)) <= 1e-6*maxval(abs(f)), 'forces, single')

      x(1, :) = modulo(x(1, :) + 1, edge)
      call engine%set_positions(x(:, n:1:-1))
      call engine%get_positions(y(:, n:1:-1))
      call near(y, x, 'set_positions, reversed')
   end subroutine outputs

   ! Equal up to the resolution of the box, in as many rows as x has.
   subroutine near(has, x, what)
      real(real64), intent(in) :: has(:, :), x(:, :)
      character(*), intent(in) :: what
      call check(maxval(abs(has(:size(x, 1), :) - x)) <= 1e-14_real64*edge, what)
   end subroutine near
end module layouts_parts

program layouts
   use checking, only: finish
   use layouts_parts
   implicit none
   type(gbg_context_t) :: context
   call context%create('cpu')
   call inputs(context, 2)
   call inputs(context, 3)
   call outputs(context, 2)
   call outputs(context, 3)
   call finish()
end program layouts
