! Options of every type through the module; text goes in and out without blanks or nulls at its end.
program texts
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use checking, only: check, check_close, check_text, finish
   use gamboge
   implicit none
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   character(:), allocatable, save :: text
   character(40) :: padded
   character(1000) :: long
   integer(int32) :: i32
   integer(int64) :: i64, count
   real(real32) :: r32
   real(real64) :: r64, lengths(3), origin(3), diameter, alpha, mobility, cutoff
   logical :: flag
   integer :: species, n_species, n_forces, stat

   call context%create('cpu:threads=2')
   call context%backend(name=text, threads=i32)
   call check_text(text, 'cpu', 'backend')
   call check(i32 == 2, 'threads')
   call scene%create(context, 3_int64)

   padded = 'bounce'
   call scene%set('excluded_volume.rule', padded)
   call scene%get('excluded_volume.rule  ', text)
   call check_text(text, 'bounce', 'text of an option')
   long = repeat('p', 999)
   call scene%set('output.trajectory.file', long)
   call scene%get('output.trajectory.file', text)
   call check_text(text, trim(long), 'a long path')
   call scene%set('output.trajectory.file', '')
   call scene%get('output.trajectory.file', text)
   call check_text(text, '', 'an empty path')

   call scene%set('dynamics.dt', 0.01_real64)
   call scene%get('dynamics.dt', r64)
   call check_close(r64, 0.01_real64, 0.0_real64, 'real64')
   call scene%set('dynamics.dt', 0.25)
   call scene%get('dynamics.dt', r32)
   call check_close(real(r32, real64), 0.25_real64, 0.0_real64, 'real32')
   call scene%set('run.seed', 7)
   call scene%get('run.seed', i32)
   call check(i32 == 7, 'int32')
   call scene%set('run.seed', 4294967295_int64)
   call scene%get('run.seed', i64)
   call check(i64 == 4294967295_int64, 'int64')
   call scene%get('run.seed', i32, stat)
   call check(stat == gbg_e_space .and. i32 == 7, 'a number that needs int64')
   call scene%set('output.trajectory.overlap', .true.)
   call scene%get('output.trajectory.overlap', flag)
   call check(flag, 'switch on')
   call scene%set('output.trajectory.overlap', .false.)
   call scene%get('output.trajectory.overlap', flag)
   call check(.not. flag, 'switch off')

   call scene%set_box([1.0_real64, 2.0_real64, 3.0_real64], origin=[-0.5_real64, 0.0_real64, 1.0_real64])
   call scene%get_box(lengths, origin)
   call check(all(abs(lengths - [1, 2, 3]) <= 0), 'box lengths')
   call check_close(origin(1), -0.5_real64, 0.0_real64, 'origin')
   call scene%set_box([4.0, 5.0, 6.0])
   call scene%get_box(lengths, origin)
   call check(all(abs(lengths - [4, 5, 6]) <= 0) .and. all(abs(origin) <= 0), 'box in single precision')

   call scene%add_species('A', 1.0_real64, -1.0_real64, 2.0_real64, count=100, species=species)
   call check(species == 1, 'species count from 1')
   call scene%add_species('second   ', 0.5, 1.0, -2.0, count=50, species=species)
   call check(species == 2, 'second species')
   call scene%get_species(2, name=text, diameter=diameter, alpha=alpha, mobility=mobility, count=count)
   call check_text(text, 'second', 'species name')
   call check_close(diameter, 0.5_real64, 0.0_real64, 'diameter')
   call check_close(mobility, -2.0_real64, 0.0_real64, 'mobility')
   call check(count == 50, 'count')
   call scene%add_force(2)
   call scene%add_force(7.0_real64, 'cutoff', cutoff=1.5_real64)
   call scene%get_size(n_species, n_forces)
   call check(n_species == 2 .and. n_forces == 2, 'numbers of species and forces')
   call scene%get_force(1, sum=text)
   call check_text(text, 'lattice', 'default sum')
   call scene%get_force(2, power=r64, sum=text, cutoff=cutoff)
   call check_text(text, 'cutoff', 'sum')
   call check_close(cutoff, 1.5_real64, 0.0_real64, 'cutoff')
   call check_close(r64, 7.0_real64, 0.0_real64, 'power')
   call scene%get_force(3, power=r64, stat=stat)
   call check(stat /= gbg_ok, 'a force that is not there')
   deallocate (text)
   call finish()
end program texts
